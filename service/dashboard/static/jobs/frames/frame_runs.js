// The statuses of all frames of a job: runs as the API gives them, and arrays as the page keeps them.

export const STATUSES = ["waiting", "rendering", "done", "failed", "skipped"];

// The frames and the places of their statuses in `STATUSES`, from runs of equal statuses.
export function expand(runs) {
  const total = runs.reduce((sum, { first, last, step }) => sum + Math.floor((last - first) / step) + 1, 0);
  const numbers = new Int32Array(total);
  const statuses = new Uint8Array(total);
  let at = 0;
  for (const { first, last, step, status } of runs) {
    const code = Math.max(0, STATUSES.indexOf(status));
    for (let frame = first; frame <= last; frame += step) {
      numbers[at] = frame;
      statuses[at++] = code;
    }
  }
  return { numbers, statuses };
}

// The place of a frame among the numbers, which may be in any order; -1 if it is none of them.
export const placeOfFrame = (numbers, frame) => numbers.indexOf(frame);

// How many frames have each status, in the order of `STATUSES`.
export function countsOf(statuses) {
  const counts = STATUSES.map(() => 0);
  for (const code of statuses) counts[code]++;
  return counts;
}

// The frames of a status as a text, such as "3, 5-9", which ends after so many parts.
export function textOf({ numbers, statuses }, status, most) {
  const code = STATUSES.indexOf(status);
  const parts = [];
  for (let at = 0; at < numbers.length; at++) {
    if (statuses[at] !== code) continue;
    const first = at;
    while (statuses[at + 1] === code && numbers[at + 1] === numbers[at] + 1) at++;
    if (parts.length === most) return `${parts.join(", ")} …`;
    parts.push(at > first ? `${numbers[first]}-${numbers[at]}` : `${numbers[first]}`);
  }
  return parts.join(", ");
}
