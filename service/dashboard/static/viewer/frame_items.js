// The frames that are done, and the paths of their pictures.

const PICTURES = ["thumb", "integral", "orthoscopic", "views"];
const stemOf = (frame) => `/${String(frame).padStart(4, "0")}.`;

// The pictures of a frame whose page of the list is not loaded: they are named like those of another frame.
export function itemLike(item, frame) {
  const renamed = (path) => {
    const at = path?.lastIndexOf(stemOf(item.frame)) ?? -1;
    if (at < 0) return null;
    return path.slice(0, at) + stemOf(frame) + path.slice(at + stemOf(item.frame).length);
  };
  const pictures = Object.fromEntries(PICTURES.map((picture) => [picture, renamed(item[picture])]));
  return { ...item, ...pictures, frame };
}

// The numbers of the frames that are done: those of the loaded pages, or all if their statuses are known.
export function numbersOf(items, grid, done) {
  if (!grid?.numbers.length) return items.map((item) => item.frame);
  return Array.from(grid.numbers).filter((_, at) => grid.statuses[at] === done);
}
