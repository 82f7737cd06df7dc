// The list of jobs: pages of the jobs that a query finds, loaded where the user looks. Events keep the rows current;
// the order changes only while the user holds the list neither by the pointer nor by the keyboard.
import { getJobs } from "../api/operations.js";
import { isNewestFirst, requestOf } from "../jobs/list/list_query.js";
import { pagesOf } from "../shared/windowing.js";
import { change, fetchJobs, forgetJobs, getState } from "./store.js";

const ROWS_A_PAGE = 50;
const MOST_PAGES = 12; // Pages far from the window are forgotten.
const MOST_JOBS = 200; // Jobs in memory beyond those of the pages; events bring them.
const SCROLL_PAUSE_MS = 60;
const RENEW_MS = 500; // A burst of events renews the list once,
const RENEW_AGAIN_MS = 3000; // and many bursts do so at this interval.

let window_ = [0, 1]; // the rows that are drawn
let isHeld = false;
let loading = new Set(); // the numbers of the pages that are being loaded
let round = 0; // counts the queries
let scrollTimer = null;
let renewTimer = null;
let renewed_ms = 0;
let newest = ""; // the id of the newest job of a list that begins with it

// The list of another query begins at its top.
export async function openList(query) {
  round++;
  loading = new Set();
  window_ = [0, 1];
  isHeld = false;
  change({ list: { ...getState().list, query, isLoaded: false, ids: {}, isStale: false, fault: "" } });
  await loadPages([0]).catch(() => {});
}

export function showRows(first, end) {
  window_ = [first, end];
  scrollTimer ??= setTimeout(() => {
    scrollTimer = null;
    const { ids, total } = getState().list;
    const rows = pagesOf(window_[0], window_[1], ROWS_A_PAGE);
    const missing = rows.filter((page) => ids[page * ROWS_A_PAGE] === undefined && page * ROWS_A_PAGE < total);
    loadPages(missing.filter((page) => !loading.has(page))).catch(() => {});
  }, SCROLL_PAUSE_MS);
}

// While the list is held, its order stays.
export function holdList(is) {
  isHeld = is;
  if (!is && getState().list.isStale) renewSoon();
}

export async function renewList({ force = false } = {}) {
  renewed_ms = Date.now();
  if (getState().list.query === null) return;
  await loadPages(pagesOf(window_[0], Math.max(1, window_[1]), ROWS_A_PAGE), { isRenewal: true, force });
}

// After events may have been missed, rows that are not drawn are forgotten too.
export async function reloadList() {
  const { list } = getState();
  change({ list: { ...list, ids: inWindow(list.ids) } });
  await renewList();
}

// An event of a job, which was known as `before` or not at all.
export function hearOfListed(job, before) {
  const { query } = getState().list;
  if (query === null) return;
  // The ids of jobs rise with time.
  const isOther = before?.status !== job.status || before?.priority !== job.priority;
  const moves = isNewestFirst(query) ? job.id > newest : isOther;
  if (!moves && !job.removed) return;
  change({ list: { ...getState().list, isStale: true } });
  renewSoon();
}

// Renews what the events do not bring: pictures, reasons to wait, and the order.
export function renewSoon() {
  if (isHeld && getState().list.isStale) return;
  const wait_ms = Math.max(RENEW_MS, renewed_ms + RENEW_AGAIN_MS - Date.now());
  renewTimer ??= setTimeout(() => {
    renewTimer = null;
    renewList().catch(() => {});
  }, wait_ms);
}

async function loadPages(pages, { isRenewal = false, force = false } = {}) {
  const now = round;
  const { query } = getState().list;
  for (const page of pages) loading.add(page);
  const ask = (page) =>
    fetchJobs(
      () => getJobs({ ...requestOf(query), offset: page * ROWS_A_PAGE, limit: ROWS_A_PAGE, count: true }),
      (answer) => answer.items,
    );
  try {
    const answers = await Promise.all(pages.map(ask));
    if (now !== round) return;
    const mayMove = !isRenewal || force || !isHeld;
    pages.forEach((page, at) => put(page, answers[at], { mayMove, isRenewal }));
    forget();
  } catch (error) {
    if (now === round) change({ list: { ...getState().list, fault: error.message } });
    throw error;
  } finally {
    if (now === round) for (const page of pages) loading.delete(page);
  }
}

function put(page, { items, total }, { mayMove, isRenewal }) {
  const { list } = getState();
  const rows = {};
  if (page === 0 && isNewestFirst(list.query)) newest = items[0]?.id ?? "";
  items.forEach((job, at) => (rows[page * ROWS_A_PAGE + at] = job.id));
  const isAsBefore = total === list.total && Object.keys(rows).every((row) => list.ids[row] === rows[row]);
  if (isRenewal && !mayMove) return change({ list: { ...list, fault: "", isStale: list.isStale || !isAsBefore } });
  const isBeside = (row) => Math.floor(Number(row) / ROWS_A_PAGE) !== page && Number(row) < total;
  // After a change of the order, other pages are no longer right; they are loaded again when they are seen.
  const kept = isRenewal && !isAsBefore ? inWindow(list.ids) : list.ids;
  const ids = { ...Object.fromEntries(Object.entries(kept).filter(([row]) => isBeside(row))), ...rows };
  change({ list: { ...list, ids, total, isLoaded: true, fault: "", isStale: isRenewal ? false : list.isStale } });
}

function inWindow(ids) {
  const pages = new Set(pagesOf(window_[0], window_[1], ROWS_A_PAGE));
  return Object.fromEntries(Object.entries(ids).filter(([row]) => pages.has(Math.floor(Number(row) / ROWS_A_PAGE))));
}

// Keeps memory flat: pages far from the window, and jobs of no page, are forgotten.
function forget() {
  const { list, jobs, frames } = getState();
  const pages = new Set(Object.keys(list.ids).map((row) => Math.floor(Number(row) / ROWS_A_PAGE)));
  if (pages.size > MOST_PAGES) change({ list: { ...list, ids: inWindow(list.ids) } });
  const ids = new Set([...Object.values(getState().list.ids), frames?.job]);
  if (Object.keys(jobs).length > ids.size + MOST_JOBS) forgetJobs((id) => ids.has(id));
}
