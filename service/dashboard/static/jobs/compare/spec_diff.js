// What differs between two job files.

// The values of a job file by their paths, such as "rig.lens_array.pitch_mm"; lists are values as a whole.
function leaves(value, path, found) {
  const isTree = value !== null && typeof value === "object" && !Array.isArray(value);
  if (!isTree || !Object.keys(value).length) found.set(path, value);
  else for (const [name, part] of Object.entries(value)) leaves(part, path ? `${path}.${name}` : name, found);
  return found;
}

// The differences in the order of the first file: [{path, values: [text, text]}]; a value that is missing is "–".
export function differences(one, other) {
  const sides = [leaves(one, "", new Map()), leaves(other, "", new Map())];
  const paths = new Set([...sides[0].keys(), ...sides[1].keys()]);
  return [...paths]
    .map((path) => ({ path, values: sides.map((side) => (side.has(path) ? JSON.stringify(side.get(path)) : "–")) }))
    .filter(({ values }) => values[0] !== values[1]);
}

// The frames that both have done, in order, from the runs of the API.
export function commonFrames(runs, otherRuns) {
  const other = new Set(doneFrames(otherRuns));
  return doneFrames(runs).filter((frame) => other.has(frame));
}

function doneFrames(runs) {
  const frames = [];
  for (const { status, first, last, step } of runs)
    if (status === "done") for (let frame = first; frame <= last; frame += step) frames.push(frame);
  return frames;
}

// The view (u, v) of a frame that an eye at a place sees: -1 is left and top, 1 is right and bottom. A view that a
// hexagonal lens does not have is the central one.
export function viewAt({ us, vs, missing, centre }, { x, y }) {
  const at = (place, number) => Math.round(((Math.min(1, Math.max(-1, place)) + 1) / 2) * (number - 1));
  const [u, v] = [at(x, us), at(y, vs)];
  return missing.some(([mu, mv]) => mu === u && mv === v) ? centre : [u, v];
}
