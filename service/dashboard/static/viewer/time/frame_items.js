// The frames of a job that are done, what is before and after one of them, and the paths of their pictures.

const PICTURES = {
  thumb: ["thumbs", "webp"],
  integral: ["integral", "exr"],
  orthoscopic: ["orthoscopic", "exr"],
  views: ["views", "exr"],
};

// The pictures of a frame that is done; `pathOf(name)` is the path of a file of its job.
export function itemOf(frame, pathOf) {
  const stem = String(frame).padStart(4, "0");
  const paths = Object.entries(PICTURES).map(([what, [folder, type]]) => [what, pathOf(`${folder}/${stem}.${type}`)]);
  return { frame, ...Object.fromEntries(paths) };
}

// The number of the frame of a picture, or null for no path.
export function numberOf(path) {
  const found = /\/(\d{4,})\.[a-z]+$/.exec(path ?? "");
  return found && Number(found[1]);
}

// The numbers of the frames that are done: those that a loaded page lists, and with the statuses of all frames the
// others. Either may be older than the other, so a frame is done if one of them says so.
export function numbersOf(listed, grid, done) {
  if (!grid?.numbers.length) return listed;
  const known = new Set(listed);
  return Array.from(grid.numbers).filter((number, at) => grid.statuses[at] === done || known.has(number));
}

// The places of a frame, and of those before and after it, among the frames that are done. The frame itself may not be
// done: then its place is -1, and the others are those between which it will be. `order` has all frames of the job.
export function placesAround(numbers, frame, order) {
  const at = numbers.indexOf(frame);
  if (at >= 0) return { at, before: at - 1, after: at + 1 };
  const earlier = new Set(Array.from(order).slice(0, Math.max(0, order.indexOf(frame))));
  const after = numbers.filter((number) => earlier.has(number)).length;
  return { at, before: after - 1, after };
}
