// The numbers of the charts of the farm. Pure: no DOM, no Preact.

// The history of the farm as the columns of a chart: the ends of the steps in seconds since 1970, the frames an hour,
// and the slots in use.
export function columns(history) {
  const begin_s = Date.parse(history.begins_at) / 1000;
  const times = history.frames.map((_, step) => begin_s + (step + 1) * history.step_s);
  return { times, rates: history.frames.map((frames) => (frames * 3600) / history.step_s), slots: [...history.slots] };
}

// The totals that are said in words: frames, and the mean number of slots in use.
export function totals(history) {
  const add = (values) => values.reduce((total, value) => total + value, 0);
  return { frames: add(history.frames), slots: history.slots.length ? add(history.slots) / history.slots.length : 0 };
}

// The top of an axis: a round number that is not below any value.
export function top(values) {
  const most = Math.max(1, ...values);
  const power = 10 ** Math.floor(Math.log10(most));
  return [1, 2, 5, 10].map((step) => step * power).find((value) => value >= most);
}
