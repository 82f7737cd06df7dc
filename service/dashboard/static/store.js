// What the page knows: one object, one way to change it, one way to watch it.
import { useEffect, useState } from "preact/hooks";

const NOTIFY_MS = 40; // A burst of events draws the page once.

let state = {
  link: "starting", // starting | live | polling | lost
  now_ms: Date.now(), // for "3 min ago"; moves twice a minute
  session: null, // who is logged in: {name, role}
  health: null,
  scenes: null,
  jobs: {}, // by id
  jobsCursor: null, // where the next page of the list begins
  jobsLoaded: false,
  frames: null, // of the open job: {job, pages: [{cursor, items}], cursor}
};
const watchers = new Set();
let timer = null;

export const look = () => state;

export function change(patch) {
  state = { ...state, ...patch };
  timer ??= setTimeout(notify, NOTIFY_MS);
}

function notify() {
  timer = null;
  for (const watch of [...watchers]) watch();
}

// A part of what the page knows; the component draws again when that part is another object.
export function useKnown(select, inputs = []) {
  const [, draw] = useState(null);
  useEffect(() => {
    let seen = select(state);
    const watch = () => {
      const now = select(state);
      if (now !== seen) draw({});
      seen = now;
    };
    watchers.add(watch);
    draw({}); // What changed between drawing and watching.
    return () => watchers.delete(watch);
  }, inputs);
  return select(state);
}

export function putJobs(jobs) {
  change({ jobs: { ...state.jobs, ...Object.fromEntries(jobs.map((job) => [job.id, job])) } });
}

export function dropJob(id) {
  const { [id]: _, ...jobs } = state.jobs;
  change({ jobs });
}

// A viewer looks on; buttons that the service would refuse are not shown.
export const mayChange = (known) => known.session !== null && known.session.role !== "viewer";

// Jobs newest first: their ids rise with time.
export const newestFirst = (jobs) => Object.values(jobs).sort((a, b) => (a.id < b.id ? 1 : -1));
