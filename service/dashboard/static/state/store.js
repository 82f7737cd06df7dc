// The state of the page: one object, one function that changes it, one hook that watches it.
import { useEffect, useState } from "preact/hooks";

const NOTIFY_MS = 40; // A burst of events redraws the page once.

let state = {
  link: "starting", // starting | live | polling | lost
  isOutdated: false, // The service has another release of this page.
  now_ms: Date.now(), // for "3 min ago"; updated twice a minute
  session: null, // the logged-in user, {name, role, owner_id}; the page comes with it
  health: null,
  scenes: null,
  jobs: {}, // by id
  // of the list: the query; the ids of jobs by their rows; whether the order is no longer right
  list: { query: null, isLoaded: false, total: 0, ids: {}, isStale: false, fault: "" },
  grid: null, // the statuses of all frames of the open job; see frame_statuses.js
  frames: null, // of the open job: {job, pages: [{cursor, items}], cursor}
};
const watchers = new Set();
let timer = null;

export const getState = () => state;

export function change(patch) {
  state = { ...state, ...patch };
  timer ??= setTimeout(notify, NOTIFY_MS);
}

function notify() {
  timer = null;
  for (const watch of [...watchers]) watch();
}

// A part of the state; the component is redrawn when that part is another object.
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
    draw({}); // A change between drawing and watching.
    return () => watchers.delete(watch);
  }, inputs);
  return select(state);
}

// An answer may be older than an event that came while it was on its way: it then says nothing of the job of the event.
// What no request is on its way for is not kept.
const heardOf = new Map(); // The number of the last event of each job.
const removed = new Set();
let heard = 0;
let onTheirWay = 0;

// Puts the job of an event.
export function hear(job) {
  if (onTheirWay) heardOf.set(job.id, ++heard);
  put([job]);
}

export function dropJob(id) {
  if (onTheirWay) {
    heardOf.set(id, ++heard);
    removed.add(id);
  }
  const { [id]: _, ...jobs } = state.jobs;
  change({ jobs });
}

// Forgets jobs that nothing shows.
export function forgetJobs(isKept) {
  change({ jobs: Object.fromEntries(Object.entries(state.jobs).filter(([id]) => isKept(id))) });
}

// Sends a request, puts the jobs of its answer, and returns the answer.
export async function fetchJobs(request, jobsOf) {
  const asked = heard;
  onTheirWay++;
  try {
    const answer = await request();
    // What an event said and the page has forgotten since is not newer than nothing.
    put(jobsOf(answer).filter(({ id }) => !(heardOf.get(id) > asked) || (!(id in state.jobs) && !removed.has(id))));
    return answer;
  } finally {
    onTheirWay--;
    if (!onTheirWay) {
      heardOf.clear();
      removed.clear();
    }
  }
}

export const fetchJob = (request) => fetchJobs(request, (job) => [job]);

function put(jobs) {
  change({ jobs: { ...state.jobs, ...Object.fromEntries(jobs.map((job) => [job.id, job])) } });
}

// A viewer may change nothing, so the buttons that the service would refuse are hidden.
export const maySubmit = (known) => known.session !== null && known.session.role !== "viewer";

// Only the owner of a job and admins change it.
export const mayChange = (known, job) =>
  maySubmit(known) && (known.session.role === "admin" || known.session.owner_id === job.owner_id);
