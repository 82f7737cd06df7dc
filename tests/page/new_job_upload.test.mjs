// A folder becomes a zip, and its name becomes the name of a scene.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bundleOf, sceneName } from "../../service/dashboard/static/new-job/scenes/dropped.js";
import { crc32, zipOf } from "../../service/dashboard/static/new-job/scenes/zip.js";

const bytesOf = (text) => new TextEncoder().encode(text);
const file = (path, text, size = text.length) => ({
  name: path.split("/").at(-1),
  webkitRelativePath: path,
  size,
  arrayBuffer: async () => bytesOf(text).buffer,
});

test("the checksum is that of the standard", () => {
  assert.equal(crc32(bytesOf("123456789")), 0xcbf43926);
});

test("a zip has its files, their list, and the end that counts them", async () => {
  const zip = Buffer.concat(
    zipOf([
      { name: "scene.toml", bytes: bytesOf("title") },
      { name: "maps/ä.png", bytes: bytesOf("x") },
    ]),
  );
  assert.equal(zip.readUInt32LE(0), 0x04034b50);
  const end = zip.subarray(-22);
  assert.deepEqual([end.readUInt32LE(0), end.readUInt16LE(10)], [0x06054b50, 2]);
  const list = end.readUInt32LE(16);
  assert.equal(zip.readUInt32LE(list), 0x02014b50);
  assert.equal(list + end.readUInt32LE(12), zip.length - 22);
  assert.ok(zip.includes("maps/ä.png"));
});

test("a chosen folder is a bundle without the folder itself, under its name", async () => {
  const files = [file("My Scene 2/scene.toml", "a"), file("My Scene 2/maps/b.png", "b")];
  const { name, bundle } = await bundleOf({ files });
  assert.equal(name, "my-scene-2");
  const text = Buffer.from(await bundle.arrayBuffer()).toString();
  assert.ok(text.includes("maps/b.png") && !text.includes("My Scene 2"));
});

test("a zip stays as it is", async () => {
  const zip = { ...file("balls.zip", "PK"), webkitRelativePath: "" };
  assert.deepEqual(await bundleOf({ files: [zip] }), { name: "balls", bundle: zip });
});

test("what is too large is refused before it is read", async () => {
  await assert.rejects(bundleOf({ files: [file("a/b.ply", "x", 300 * 2 ** 20)] }), /at most 256 MiB, and this has 300/);
  await assert.rejects(bundleOf({ files: Array(2001).fill(file("a/b", "x")) }), /at most 2000 files/);
  await assert.rejects(bundleOf({ files: [] }), /no file/);
});

test("a name has the letters that the service accepts", () => {
  assert.deepEqual(["Fish & Co.zip", "a/b/Ünder_water", "!!!"].map(sceneName), ["fish-co", "under-water", "scene"]);
});

test("folders in another script become scenes of different names, each always the same", () => {
  const names = ["東京", "大阪", "東京 2", "大阪 2"].map(sceneName);
  assert.equal(new Set(names).size, 4);
  assert.deepEqual(names, ["東京.zip", "a/大阪", "東京 2", "大阪 2"].map(sceneName));
  for (const name of names) assert.match(name, /^[a-z0-9][a-z0-9-]*$/);
});
