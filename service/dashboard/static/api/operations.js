// The requests to the API; no other module uses HTTP.
import { hearDate } from "./clock.js";

const ROOT = document.body.dataset.root; // The path under which a reverse proxy serves the dashboard, or nothing.
// The bridge of a Looking Glass panel on the machine of the user, or nothing.
export const panelUrl = document.body.dataset.panel;
const BASE = `${ROOT}/api/v1`;
const LOGIN = `${ROOT}/login`;
const PATIENCE_MS = 20_000;
const UPLOAD_MS = 600_000;

// An error of the API, as problem details of RFC 9457.
export class Problem extends Error {
  constructor(status, body) {
    super(body.detail || body.title || `The service answered ${status}.`);
    this.status = status;
    this.fields = body.errors || [];
    this.requestId = body.request_id || "";
  }
}

// The service or the network is unavailable.
export class Unreachable extends Error {
  constructor() {
    super("The service does not answer.");
  }
}

export const getJobs = (query) => get("/jobs", query);
export const getJob = (id) => get(`/jobs/${encodeURIComponent(id)}`);
export const getFrames = (id, cursor, limit) => get(`/jobs/${encodeURIComponent(id)}/frames`, { limit, cursor });
export const getFrameStatuses = (id) => get(`/jobs/${encodeURIComponent(id)}/frames/statuses`);
export const getTasks = (id, query) => get(`/jobs/${encodeURIComponent(id)}/tasks`, query);
export const getTask = (id, task) => get(`/jobs/${encodeURIComponent(id)}/tasks/${encodeURIComponent(task)}`);
export const getAttempts = (id, limit) => get(`/jobs/${encodeURIComponent(id)}/attempts`, { limit });
export const getArtifacts = (id, limit) => get(`/jobs/${encodeURIComponent(id)}/artifacts`, { limit });
export const getLog = (id, task, attempt) =>
  get(`/jobs/${encodeURIComponent(id)}/tasks/${encodeURIComponent(task)}/log`, { attempt });
export const getSidecar = (url) => answered(url, {});
export const getScenes = () => get("/scenes", { limit: 200 });
export const getHealth = () =>
  answered(`${BASE}/health`, { cache: "no-store", heard: ({ headers }) => hearDate(headers.get("Date")) });
export const getWorkers = () => get("/workers");
export const getFarm = () => get("/farm");
export const getFarmHistory = (hours) => get("/farm/history", { hours });
export const getFarmOwners = () => get("/farm/owners");
export const getKeys = () => get("/keys");
export const getWorkerKeys = () => get("/worker-keys");
export const getUsage = () => get("/usage");
export const getAudit = (filter, cursor) => get("/audit", { ...filter, cursor, limit: 50 });
export const postKey = (key) => send("POST", "/keys", key);
export const deleteKey = (id) => send("DELETE", `/keys/${encodeURIComponent(id)}`);
export const getSessions = () => get("/sessions");
export const deleteSession = (id) => send("DELETE", `/sessions/${encodeURIComponent(id)}`);
export const restartTask = (id, task) => send("POST", `/jobs/${encodeURIComponent(id)}/tasks/${task}/restart`);
export const endTask = (id, task) => send("POST", `/jobs/${encodeURIComponent(id)}/tasks/${task}/end`);
const WORKER_ACTIONS = {
  drain: ["PUT", "drain"],
  undrain: ["DELETE", "drain"],
  forgive: ["DELETE", "faults"],
  exclude: ["PUT", "exclusion"],
  include: ["DELETE", "exclusion"],
};
export function sendWorkerAction(worker, action) {
  const [method, what] = WORKER_ACTIONS[action];
  return send(method, `/workers/${encodeURIComponent(worker)}/${what}`);
}

// A large scene on a slow line takes long.
export function postScene(name, bundle) {
  const body = new FormData();
  body.append("bundle", bundle, `${name}.zip`);
  const headers = { "X-Lippmann-Request": "1" };
  return answered(withQuery(`${BASE}/scenes`, { name }), { method: "POST", headers, body, patience_ms: UPLOAD_MS });
}

export const postJob = (spec, key) => send("POST", "/jobs", spec, { "Idempotency-Key": key });
export const getSchema = (name) => get(`/schemas/${name}`);
export const postCheck = (spec) => send("POST", "/design/check", spec);
export const postDesign = (spec) => send("POST", "/design", spec);
export const postPreview = (spec, stream) => send("POST", `/preview?${new URLSearchParams({ stream })}`, spec);
export const postDrawing = (spec) => send("POST", "/design", spec, { Accept: "image/svg+xml" });
export const sendAction = (id, action) => send("POST", `/jobs/${encodeURIComponent(id)}/${action}`);
export const patchJob = (id, change) => send("PATCH", `/jobs/${encodeURIComponent(id)}`, change);
export const removeJob = (id) => send("DELETE", `/jobs/${encodeURIComponent(id)}`);
export const getFrameViews = (id, frame, max_px, signal) =>
  answered(pictureUrl(id, frame, "look", { max_px }), { signal });
export const eventsUrl = `${BASE}/events`;

// The URL of a path in an answer of the API.
export const link = (path) => ROOT + path;

// The path of a file of a job, such as thumbs/0001.webp.
export const artifactPath = (id, name) => `/api/v1/jobs/${encodeURIComponent(id)}/artifacts/${name}`;

// Masters are OpenEXR; this is the URL of the same picture as PNG.
export const asPng = (path) => `${link(path)}?format=png`;

// The service answers both with a redirect, which the caller follows itself.
export async function logIn(key) {
  await answered(LOGIN, { method: "POST", body: new URLSearchParams({ key }), redirect: "manual" });
}

export async function logOut() {
  await answered(link("/logout"), { method: "POST", headers: { "X-Lippmann-Request": "1" }, redirect: "manual" });
}

// The URL of a picture of a frame: a view, a refocused picture, the picture of an observer.
export function pictureUrl(id, frame, what, query) {
  return withQuery(`${BASE}/jobs/${encodeURIComponent(id)}/frames/${frame}/${what}`, query);
}

// The depth to which to refocus, so that what is at a place {x, y}, 0 to 1, is sharp.
export const getFocusDepth = (id, frame, place) => get(`/jobs/${encodeURIComponent(id)}/frames/${frame}/depth`, place);

// Whether the service still has the modules of this page: after an update it has others.
export async function isPageCurrent() {
  const loaded = new URL(document.querySelector("script[type=module]").getAttribute("src"), location.href);
  const etag = `"${loaded.searchParams.get("v")}"`;
  const request = { cache: "no-store", headers: { "If-None-Match": etag }, signal: endOf(null, PATIENCE_MS) };
  const response = await fetch(loaded.pathname, /** @type {RequestInit} */ (request)).catch(() => null);
  await response?.body?.cancel();
  return response?.status !== 200;
}

// The bytes of a PFM.
export async function getNumbers(url, signal) {
  return (await answered(link(url), { signal })).arrayBuffer();
}

export const getFile = (url) => answered(url, {});

// Loads a picture without colour conversion.
export async function getPicture(url, signal) {
  return createImageBitmap(await answered(url, { signal }), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
}

function get(path, query = {}) {
  return answered(withQuery(BASE + path, query), {});
}

function withQuery(path, query) {
  const given = Object.entries(query)
    .flatMap(([name, value]) => (Array.isArray(value) ? value.map((one) => [name, one]) : [[name, value]]))
    .filter(([, value]) => value !== undefined && value !== null);
  const text = new URLSearchParams(given).toString();
  return path + (text && `?${text}`);
}

function send(method, path, body, headers = {}) {
  return answered(BASE + path, {
    method,
    headers: { "X-Lippmann-Request": "1", ...(body && { "Content-Type": "application/json" }), ...headers },
    body: body && JSON.stringify(body),
  });
}

/**
 * @param {string} url
 * @param {RequestInit & { patience_ms?: number, heard?: (response: Response) => void }} request
 */
async function answered(url, { signal = null, patience_ms = PATIENCE_MS, heard, ...request }) {
  let response, body;
  try {
    response = await fetch(url, { credentials: "same-origin", signal: endOf(signal, patience_ms), ...request });
    body = await bodyOf(response);
  } catch {
    throw new Unreachable();
  }
  heard?.(response);
  // The session has ended. The login page says so, and leads back here.
  if (response.status === 401 && url !== LOGIN) location.replace(`${ROOT}/?refused=ended${location.hash}`);
  if (!response.ok && response.type !== "opaqueredirect") throw new Problem(response.status, body);
  return body;
}

async function bodyOf(response) {
  if (response.status === 204) return {}; // It says that it is JSON, and has no body.
  const type = response.headers.get("Content-Type") || "";
  if (/json/.test(type)) return response.json();
  if (/svg|^text/.test(type)) return response.text();
  return /^image/.test(type) ? response.blob() : {};
}

// A signal that aborts a request when the caller aborts it, or after a timeout.
function endOf(signal, patience_ms) {
  const end = new AbortController();
  setTimeout(() => end.abort(), patience_ms);
  if (signal?.aborted) end.abort();
  signal?.addEventListener("abort", () => end.abort(), { once: true });
  return end.signal;
}
