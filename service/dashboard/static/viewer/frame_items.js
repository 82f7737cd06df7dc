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

// The numbers of the frames that are done: those of the loaded pages, and with the statuses of all frames the others.
// Either may be older than the other, so a frame is done if one of them says so.
export function numbersOf(items, grid, done) {
  const loaded = items.map((item) => item.frame);
  if (!grid?.numbers.length) return loaded;
  const known = new Set(loaded);
  return Array.from(grid.numbers).filter((number, at) => grid.statuses[at] === done || known.has(number));
}
