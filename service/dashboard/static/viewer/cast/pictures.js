// The picture that a panel gets of a frame: the quilt that the job has made, or one of the views in the viewer.
import { artifactPath, getFile, getSidecar, link } from "../../api/operations.js";
import { fileOfFrame, quiltOf } from "./quilt.js";

// Returns {columns, rows, aspect, bytes}; the bytes are a PNG.
export async function castPicture(job, frame, atlases) {
  return (await madeByJob(job, frame)) ?? drawn(await atlases.get(frame, "whole"));
}

// A quilt with rows of views above each other is for other displays.
async function madeByJob(job, frame) {
  const place = job.spec.outputs.findIndex(({ kind, views }) => kind === "quilt" && views !== "all");
  if (place < 0 || !job.outputs[place].ready) return null;
  const { files, columns, rows, aspect } = await getSidecar(link(job.outputs[place].url));
  const file = fileOfFrame(files, frame);
  if (!file) return null;
  const blob = await getFile(link(artifactPath(job.id, file)));
  return { columns, rows, aspect, bytes: await bytesOf(blob) };
}

async function drawn({ frameViews, bitmap }) {
  const { tiles, tile, width, height, ...layout } = quiltOf(frameViews);
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d");
  for (const { from, to } of tiles) {
    context.drawImage(bitmap, from.x, from.y, tile.width, tile.height, to.x, to.y, tile.width, tile.height);
  }
  return { ...layout, bytes: await bytesOf(await new Promise((put) => canvas.toBlob(put))) };
}

const bytesOf = async (blob) => new Uint8Array(await blob.arrayBuffer());
