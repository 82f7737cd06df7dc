// Zoom and pan. A zoom is {scale, x, y}: at scale 1 the picture fits into the stage, and (x, y) is the part of the
// picture, 0 to 1, in the middle of the stage. Sizes are {width, height}; those of a stage are in px.
import { clamp } from "../painting/views.js";

export const FIT = { scale: 1, x: 0.5, y: 0.5 };
export const MOST = 64;

// The size of the picture on the stage.
function shownSize(scale, picture, stage) {
  const times = scale * Math.min(stage.width / picture.width, stage.height / picture.height);
  return { width: picture.width * times, height: picture.height * times };
}

// The rectangle of the picture on the stage, in px from its upper left corner.
export function rectOf({ scale, x, y }, picture, stage) {
  const { width, height } = shownSize(scale, picture, stage);
  return { left: stage.width / 2 - x * width, top: stage.height / 2 - y * height, width, height };
}

// A zoom whose picture leaves no room on the stage that it could fill; what fits stands in the middle.
export function bounded({ scale, x, y }, picture, stage) {
  const times = clamp(scale, 1, MOST);
  const { width, height } = shownSize(times, picture, stage);
  const along = (part, room, size) => {
    const margin = Math.min(0.5, room / 2 / size);
    return clamp(part, margin, 1 - margin);
  };
  return { scale: times, x: along(x, stage.width, width), y: along(y, stage.height, height) };
}

// Enlarges by a factor around a point of the stage, which keeps its part of the picture.
export function zoomedAt(zoom, factor, point, picture, stage) {
  const scale = clamp(zoom.scale * factor, 1, MOST);
  const [across, down] = partAt(zoom, point, picture, stage);
  const { width, height } = shownSize(scale, picture, stage);
  const x = across - (point.x - stage.width / 2) / width;
  const y = down - (point.y - stage.height / 2) / height;
  return bounded({ scale, x, y }, picture, stage);
}

// Moves the picture by px of the stage.
export function panned(zoom, across_px, down_px, picture, stage) {
  const { width, height } = shownSize(zoom.scale, picture, stage);
  const moved = { ...zoom, x: zoom.x - across_px / width, y: zoom.y - down_px / height };
  return bounded(moved, picture, stage);
}

// The part of the picture, 0 to 1 inside it, at a point of the stage.
export function partAt(zoom, point, picture, stage) {
  const { left, top, width, height } = rectOf(zoom, picture, stage);
  return [(point.x - left) / width, (point.y - top) / height];
}

export const isFit = ({ scale }) => scale === 1;
