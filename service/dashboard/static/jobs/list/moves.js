// The order in which open jobs get slots, and what changes it: the highest priority comes first, among equals the job
// with the lowest id, which is the oldest.

const LOWEST = 0;
const HIGHEST = 100;
const STEP = 10; // above the first job and below the last one

/**
 * The fewest changes of priorities that bring a job to another place; null if there is no room for it.
 *
 * @param {{id: string, priority: number, isFixed?: boolean}[]} jobs in the order of work; those that are fixed keep
 *   their priorities
 * @param {number} from
 * @param {number} to its place after the move
 * @returns {{id: string, priority: number}[] | null}
 */
export function planMove(jobs, from, to) {
  if (from === to) return [];
  const moved = jobs[from];
  const after = jobs.filter((job) => job !== moved);
  after.splice(to, 0, moved);
  for (let others = 0; others < jobs.length; others++)
    for (let raised = others; raised >= 0; raised--) {
      const first = to - raised;
      const last = first + others;
      if (first < 0 || last >= after.length) continue;
      const block = after.slice(first, last + 1);
      if (block.some((job) => job !== moved && job.isFixed)) continue;
      const found = fit(block, { above: after[first - 1], below: after[last + 1], at: raised });
      if (found) return found.filter(({ id, priority }, at) => block[at].id === id && block[at].priority !== priority);
    }
  return null;
}

// Priorities of jobs that follow each other between two that keep theirs, null if there are none. `at` is the place of
// the moved job; the others change as little as they can.
function fit(block, { above, below, at }) {
  const most = [];
  const least = [];
  for (let i = 0; i < block.length; i++)
    most[i] = i ? under(block[i - 1], most[i - 1], block[i]) : above ? under(above, above.priority, block[i]) : HIGHEST;
  for (let i = block.length - 1; i >= 0; i--) {
    const next = block[i + 1] ?? below;
    least[i] = next ? over(next, least[i + 1] ?? next.priority, block[i]) : LOWEST;
  }
  if (most.some((priority, i) => priority < least[i])) return null;
  const found = [];
  found[at] = Math.floor((least[at] + most[at]) / 2);
  if (!above) found[at] = Math.min(most[at], least[at] + STEP);
  else if (!below) found[at] = Math.max(least[at], most[at] - STEP);
  for (let i = at - 1; i >= 0; i--) found[i] = Math.max(block[i].priority, over(block[i + 1], found[i + 1], block[i]));
  for (let i = at + 1; i < block.length; i++)
    found[i] = Math.min(block[i].priority, under(block[i - 1], found[i - 1], block[i]));
  return block.map(({ id }, i) => ({ id, priority: found[i] }));
}

// The highest priority of a job below another one, and the lowest of a job above another one.
const under = (upper, priority, job) => (upper.id < job.id ? priority : priority - 1);
const over = (lower, priority, job) => (job.id < lower.id ? priority : priority + 1);

// The place of a dragged row: the one under the pointer.
export const placeOf = (y_px, row_px, last) => Math.min(last, Math.max(0, Math.floor(y_px / row_px)));

// The jobs around a row of a list that can change places with it: the rows that are loaded without a gap, up to the
// first job that has ended. `first` is the row of the first of them.
export function neighbours(ids, jobs, row, mayChange) {
  const isOpen = (at) => jobs[ids[at]] && !jobs[ids[at]].ended_at;
  let first = row;
  let last = row;
  while (isOpen(first - 1)) first--;
  while (isOpen(last + 1)) last++;
  const found = [];
  for (let at = first; at <= last; at++) {
    const { id, priority } = jobs[ids[at]];
    found.push({ id, priority, isFixed: !mayChange(jobs[id]) });
  }
  return { first, jobs: found };
}
