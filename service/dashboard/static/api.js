// The API, and nothing else speaks HTTP here.

const BASE = "/api/v1";
const PATIENCE_MS = 20_000;

// What the API answers when it refuses: RFC 9457 problem details.
export class Problem extends Error {
  constructor(status, body) {
    super(body.detail || body.title || `The service answered ${status}.`);
    this.status = status;
    this.fields = body.errors || [];
    this.requestId = body.request_id || "";
  }
}

// Nobody answered: the service is down or the network is.
export class Unreachable extends Error {
  constructor() {
    super("The service does not answer.");
  }
}

export const getJobs = (cursor) => get("/jobs", { limit: 30, cursor });
export const getJob = (id) => get(`/jobs/${encodeURIComponent(id)}`);
export const getFrames = (id, cursor, limit) => get(`/jobs/${encodeURIComponent(id)}/frames`, { limit, cursor });
export const getFailedTasks = (id) => get(`/jobs/${encodeURIComponent(id)}/tasks`, { status: "failed", limit: 20 });
export const getSidecar = (url) => answered(url, {});
export const getScenes = () => get("/scenes", { limit: 200 });
export const getHealth = () => get("/health");
export const getSession = () => get("/session");
export const postJob = (spec, key) => send("POST", "/jobs", spec, { "Idempotency-Key": key });
export const postDesign = (spec) => send("POST", "/design", spec);
export const postDrawing = (spec) => send("POST", "/design", spec, { Accept: "image/svg+xml" });
export const sendAction = (id, action) => send("POST", `/jobs/${encodeURIComponent(id)}/${action}`);
export const getLook = (id, frame, max_px, signal) => answered(lookUrl(id, frame, "look", { max_px }), { signal });
export const eventsUrl = `${BASE}/events`;

// Masters are OpenEXR; this is the address of the same picture as a browser shows it.
export const asPng = (url) => `${url}?format=png`;

// Both answer by sending the browser on, which the caller does itself.
export async function logIn(key) {
  await answered("/login", { method: "POST", body: new URLSearchParams({ key }), redirect: "manual" });
}

export async function logOut() {
  await answered("/logout", { method: "POST", headers: { "X-Lippmann-Request": "1" }, redirect: "manual" });
}

// The address of something that is seen in a frame: a view, another focus, what an observer sees.
export function lookUrl(id, frame, what, query) {
  return withQuery(`${BASE}/jobs/${encodeURIComponent(id)}/frames/${frame}/${what}`, query);
}

// A picture as it is, in the codes that it was written in.
export async function getPicture(url, signal) {
  return createImageBitmap(await answered(url, { signal }), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
}

function get(path, query = {}) {
  return answered(withQuery(BASE + path, query), {});
}

function withQuery(path, query) {
  const given = Object.entries(query).filter(([, value]) => value !== undefined && value !== null);
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

async function answered(url, { signal, ...request }) {
  let response, body;
  try {
    response = await fetch(url, { credentials: "same-origin", signal: endOf(signal), ...request });
    body = await bodyOf(response);
  } catch {
    throw new Unreachable();
  }
  if (response.status === 401 && url !== "/login") location.reload(); // The session ended: the service asks for a key.
  if (!response.ok && response.type !== "opaqueredirect") throw new Problem(response.status, body);
  return body;
}

async function bodyOf(response) {
  const type = response.headers.get("Content-Type") || "";
  if (/json/.test(type)) return response.json();
  if (/svg/.test(type)) return response.text();
  return /^image/.test(type) ? response.blob() : {};
}

// When an answer is waited for no longer: it was given up, or it takes too long.
function endOf(signal) {
  const end = new AbortController();
  setTimeout(() => end.abort(), PATIENCE_MS);
  if (signal?.aborted) end.abort();
  signal?.addEventListener("abort", () => end.abort(), { once: true });
  return end.signal;
}
