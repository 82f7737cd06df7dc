// The timeline of attempts: a row for each slot that a worker used, and a bar for each attempt.

const TICKS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 21600, 43200, 86400];

// Lanes by worker: {workers: [{name, slots: [[bar, ...], ...]}], start_s, end_s}. Attempts that overlap in time are in
// different slots. An attempt of which no end is known ends now if it runs, and has no length otherwise.
export function layOut(attempts, now_s) {
  const bars = attempts.map((attempt) => ({
    ...attempt,
    start_s: seconds(attempt.started_at),
    end_s: endOf(attempt, now_s),
  }));
  bars.sort((a, b) => a.start_s - b.start_s || a.end_s - b.end_s);
  const workers = new Map();
  for (const bar of bars) {
    const name = bar.worker ?? "unknown";
    if (!workers.has(name)) workers.set(name, []);
    const slots = workers.get(name);
    const free = slots.find((slot) => slot.at(-1).end_s <= bar.start_s);
    if (free) free.push(bar);
    else slots.push([bar]);
  }
  return {
    workers: [...workers].sort(([a], [b]) => (a < b ? -1 : 1)).map(([name, slots]) => ({ name, slots })),
    start_s: bars.length ? bars[0].start_s : now_s,
    end_s: bars.reduce((latest, bar) => Math.max(latest, bar.end_s), bars.length ? bars[0].end_s : now_s),
  };
}

const OUTCOMES = ["done", "running", "failed", "lost", "stopped"];

// What became of attempts, and of how many; what became of none is left out.
export function outcomesOf(attempts) {
  return OUTCOMES.map((outcome) => [outcome, attempts.filter((attempt) => attempt.outcome === outcome).length]).filter(
    ([, number]) => number > 0,
  );
}

// Times between two others for the marks of an axis, in seconds after the first one.
export function ticksOf(length_s, most) {
  const step_s = TICKS_S.find((tick) => length_s / tick <= most) ?? Math.ceil(length_s / most);
  const ticks = [];
  for (let at_s = 0; at_s <= length_s; at_s += step_s) ticks.push(at_s);
  return ticks;
}

const seconds = (time) => Date.parse(time) / 1000;

function endOf({ started_at, ended_at, outcome }, now_s) {
  if (ended_at) return Math.max(seconds(ended_at), seconds(started_at));
  return outcome === "running" ? Math.max(now_s, seconds(started_at)) : seconds(started_at);
}
