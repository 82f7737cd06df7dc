// What somebody drops or chooses as a scene: a zip, or a folder, which becomes a zip.
import { crc32, zipOf } from "./zip.js";

// The service takes no larger bundle; a folder is not read before it is known to be small enough.
const MOST_FILES = 2000;
const MOST_MIB = 256;

// Returns {name, bundle} of the files of an input, or of a drop.
export async function bundleOf(transfer) {
  const entries = [...(transfer.items || [])].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const files = entries.length ? (await Promise.all(entries.map(filesOf))).flat() : [...transfer.files].map(withPath);
  const [first] = files;
  if (!first) throw new Error("There is no file in it.");
  checkSize(files);
  if (files.length === 1 && /\.zip$/i.test(first.path)) return { name: sceneName(first.path), bundle: first.file };
  const folder = first.path.includes("/") ? first.path.split("/")[0] : "";
  const inside = (path) => (folder && path.startsWith(`${folder}/`) ? path.slice(folder.length + 1) : path);
  const read = async ({ path, file }) => ({ name: inside(path), bytes: new Uint8Array(await file.arrayBuffer()) });
  const zip = zipOf(await Promise.all(files.map(read)));
  return { name: sceneName(folder || first.path), bundle: new Blob(zip, { type: "application/zip" }) };
}

function checkSize(files) {
  if (files.length > MOST_FILES) {
    throw new Error(`A scene has at most ${MOST_FILES} files, and there are ${files.length}.`);
  }
  const mib = files.reduce((sum, { file }) => sum + file.size, 0) / 2 ** 20;
  if (mib > MOST_MIB) throw new Error(`A scene has at most ${MOST_MIB} MiB, and this has ${Math.round(mib)} MiB.`);
}

const withPath = (file) => ({ path: file.webkitRelativePath || file.name, file });

// The files of an entry of a drop, which is a file or a folder.
async function filesOf(entry) {
  const path = entry.fullPath.replace(/^\//, "");
  if (entry.isFile) return [{ path, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) }];
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) break; // A reader gives at most a hundred at once.
    found.push(...some);
  }
  return (await Promise.all(found.map(filesOf))).flat();
}

// A name that the service accepts, from the name of a file or a folder. Accents go; where other letters go, a checksum
// takes their place, so that two folders in another script do not become one scene.
export function sceneName(path) {
  const whole = path
    .split("/")
    .at(-1)
    .replace(/\.[^.]*$/, "");
  const plain = whole.normalize("NFKD").replace(/\p{M}/gu, "").toLowerCase();
  const name = plain.replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "");
  if (!/[^\x00-\x7f]/.test(plain.replace(/[^\p{L}\p{N}]/gu, ""))) return name || "scene";
  const sum = crc32(new TextEncoder().encode(whole.normalize("NFC")));
  return `${name || "scene"}-${sum.toString(16).padStart(8, "0")}`;
}
