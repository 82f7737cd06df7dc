// The frames of the open job, in pages that events and requests keep current.
import { getFrames } from "../api/operations.js";
import { change, getState } from "./store.js";

export const FRAMES_A_PAGE = 120;
const PAUSE_MS = 250; // Frames that end at the same time are requested together.

const stale = new Set(); // The pages that are about to be requested.
let asked = 0; // The number of the last request.
let put = {}; // The request that each page shows.
// The last event of each frame, {status, asked}: it is newer than the answers to requests up to `asked`.
let heard = {};

export async function openFrames(job) {
  stale.clear();
  put = {};
  heard = {};
  change({ frames: { job, pages: [], cursor: null } });
  await loadMoreFrames();
}

export async function loadMoreFrames() {
  const { job, cursor, pages } = getState().frames;
  const request = ++asked;
  const page = await getFrames(job, cursor, FRAMES_A_PAGE);
  const frames = getState().frames;
  // Another job was opened.
  if (frames?.job !== job || frames.cursor !== cursor || frames.pages.length !== pages.length) return;
  change({ frames: { job, pages: [...frames.pages, { cursor, items: [] }], cursor: page.next_cursor } });
  putAnswer(job, pages.length, page, request);
}

export function hearFrame({ job, frame, status }) {
  const frames = getState().frames;
  if (frames?.job !== job) return;
  heard[frame] = { status, asked };
  const index = frames.pages.findIndex(({ items }) => items.length && items.at(-1).frame >= frame);
  if (index < 0) return;
  putItems(
    index,
    frames.pages[index].items.map((item) => (item.frame === frame ? { ...item, status } : item)),
  );
  if (status === "done") renewPage(job, index);
}

export function renewPages() {
  const { job, pages } = getState().frames;
  pages.forEach((_, index) => renewPage(job, index));
}

function renewPage(job, index) {
  if (stale.has(index)) return;
  stale.add(index);
  setTimeout(async () => {
    stale.delete(index);
    const page = getState().frames?.job === job && getState().frames.pages[index];
    if (!page) return;
    const request = ++asked;
    const answer = await getFrames(job, page.cursor, FRAMES_A_PAGE).catch(() => null);
    if (!answer || getState().frames?.job !== job || put[index] > request) return;
    putAnswer(job, index, answer, request);
  }, PAUSE_MS);
}

// Of frames of which an event came while the answer was on its way, the answer may say what is over.
function putAnswer(job, index, { items }, request) {
  const isOver = ({ frame }) => heard[frame]?.asked >= request;
  put[index] = request;
  putItems(
    index,
    items.map((item) => (isOver(item) ? { ...item, status: heard[item.frame].status } : item)),
  );
  if (items.some(isOver)) renewPage(job, index);
}

function putItems(index, items) {
  const frames = getState().frames;
  change({ frames: { ...frames, pages: frames.pages.map((page, at) => (at === index ? { ...page, items } : page)) } });
}
