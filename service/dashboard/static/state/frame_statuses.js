// The statuses of all frames of the open job: {job, numbers, statuses, version}. The arrays change in place, and each
// change of them makes another object with the next version.
import { getFrameStatuses } from "../api/operations.js";
import { expand, placeOfFrame, STATUSES } from "../jobs/frames/frame_runs.js";
import { change, getState } from "./store.js";

const RENEW_MS = 500;

let heard = null; // events since the request whose answer is on its way; null while none is
let asked = 0;
let timer = null;

export async function openStatuses(job) {
  if (getState().grid?.job !== job)
    change({ grid: { job, numbers: new Int32Array(0), statuses: new Uint8Array(0), version: 0 } });
  const request = ++asked;
  heard = [];
  const { runs } = await getFrameStatuses(job).catch((error) => {
    if (request === asked) heard = null;
    throw error;
  });
  if (request !== asked || getState().grid?.job !== job) return;
  change({ grid: { job, ...expand(runs), version: getState().grid.version + 1 } });
  // The answer may be older than an event.
  const late = heard;
  heard = null;
  late.forEach(hearStatus);
}

// Another job may have been opened before this one is closed.
export function closeStatuses(job) {
  if (getState().grid?.job !== job) return;
  asked++;
  heard = null;
  change({ grid: null });
}

export function hearStatus(event) {
  const { grid } = getState();
  if (grid?.job !== event.job) return;
  heard?.push(event);
  const at = placeOfFrame(grid.numbers, event.frame);
  if (at < 0) return;
  grid.statuses[at] = Math.max(0, STATUSES.indexOf(event.status));
  change({ grid: { ...grid, version: grid.version + 1 } });
}

// Retry and cancel change many frames without an event for each, and a stream that was interrupted may have lost some.
export function renewStatuses() {
  timer ??= setTimeout(() => {
    timer = null;
    const job = getState().grid?.job;
    if (job) openStatuses(job).catch(() => {});
  }, RENEW_MS);
}
