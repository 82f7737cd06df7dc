// Keeps the state of the page current by one event stream; while the stream is interrupted, by polling.
import { nowMs } from "../api/clock.js";
import { eventsUrl, getHealth, getJob, isPageCurrent } from "../api/operations.js";
import { hearFrame, renewPages } from "./frame_pages.js";
import { hearStatus, renewStatuses } from "./frame_statuses.js";
import { hearOfListed, reloadList, renewSoon } from "./job_list.js";
import { change, dropJob, fetchJob, getState, hear } from "./store.js";

const FIRST_WAIT_MS = 1000;
const LONGEST_WAIT_MS = 30_000;
const HEALTH_MS = 10_000;
const NOW_MS = 30_000;
const WAITS_PAUSE_MS = 500; // Reasons to wait are renewed once for a burst of events.

let stream = null;
let wait_ms = FIRST_WAIT_MS;
let connections = 0;
let waitsTimer = null;

export function start() {
  connect();
  watchHealth();
  setInterval(() => change({ now_ms: nowMs() }), NOW_MS);
}

function connect() {
  const opened = new EventSource(eventsUrl);
  const isFirst = connections++ === 0;
  stream = opened;
  opened.addEventListener("open", async () => {
    // Load the changes that happened before the stream was open.
    const isAnswered = await refresh();
    if (stream !== opened) return; // It broke off meanwhile.
    if (!isAnswered) return reconnect();
    change({ link: "live" });
    wait_ms = FIRST_WAIT_MS;
    // A service that was restarted may be another release.
    if (!isFirst && !(await isPageCurrent())) change({ isOutdated: true });
  });
  opened.addEventListener("error", () => stream === opened && reconnect());
  listen("job", hearJob);
  listen("progress", hearProgress);
  listen("frame", hearFrame);
  listen("frame", hearStatus);
  listen("reset", refresh); // Events are missing that are no longer stored.
}

function listen(kind, hear) {
  stream.addEventListener(kind, (event) => hear(JSON.parse(event.data)));
}

function reconnect() {
  stream.close();
  stream = null;
  const again = async () => {
    clearTimeout(timer);
    removeEventListener("online", again);
    change({ link: (await refresh()) ? "polling" : "lost" });
    connect();
  };
  const timer = setTimeout(again, wait_ms);
  addEventListener("online", again); // The network of this computer is back, so there is nothing to wait for.
  if (getState().link !== "polling") change({ link: "lost" });
  wait_ms = Math.min(2 * wait_ms, LONGEST_WAIT_MS);
}

function hearJob(job) {
  const before = getState().jobs[job.id];
  if (job.removed) dropJob(job.id);
  // An event has neither a reason to wait, since that depends on the whole farm, nor a picture.
  else hear({ ...job, wait: before?.wait ?? null, poster: before?.poster ?? null });
  hearOfListed(job, before);
  if (job.removed) return;
  if (mayWait(job)) waitsTimer ??= setTimeout(() => renewWaits().catch(() => {}), WAITS_PAUSE_MS);
  const frames = getState().frames;
  // Retry and cancel change many frames without an event for each.
  if (before?.status === job.status) return;
  renewSoon();
  if (frames?.job === job.id) renewPages();
  if (getState().grid?.job === job.id) renewStatuses();
}

function hearProgress(news) {
  const job = getState().jobs[news.id];
  if (job) hear({ ...job, ...news });
}

// Returns whether the service answered.
async function refresh() {
  try {
    await Promise.all([reloadList(), loadHealth()]);
    const frames = getState().frames;
    renewStatuses();
    if (frames) {
      if (!(frames.job in getState().jobs)) await loadJob(frames.job);
      renewPages();
    }
    return true;
  } catch {
    return false;
  }
}

export async function loadJob(id) {
  await fetchJob(() => getJob(id));
}

const mayWait = (job) => !job.ended_at && (!job.tasks.running || job.status === "paused");

// Loads what events do not bring: the reasons why the listed jobs and the open job wait, and their pictures.
async function renewWaits() {
  waitsTimer = null;
  const { jobs, frames } = getState();
  if (!Object.values(jobs).some((job) => !job.ended_at)) return;
  renewSoon();
  const open = frames && jobs[frames.job];
  if (open && mayWait(open)) await loadJob(open.id);
}

async function loadHealth() {
  const health = await getHealth();
  const isWrong = Math.abs(nowMs() - getState().now_ms) > NOW_MS; // The clock of this computer was.
  change(isWrong ? { health, now_ms: nowMs() } : { health });
}

function watchHealth() {
  setInterval(async () => {
    try {
      await loadHealth();
      await renewWaits();
    } catch {
      // A half-open stream reports no error, so a failed request is the sign that the service is unavailable.
      if (getState().link === "live") reconnect();
    }
  }, HEALTH_MS);
}
