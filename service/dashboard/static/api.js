// The API, and nothing else speaks HTTP here.

const BASE = "/api/v1";

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
export const moveJob = (id, move) => send("POST", `/jobs/${encodeURIComponent(id)}/${move}`);
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

function get(path, query = {}) {
  const given = Object.entries(query).filter(([, value]) => value !== undefined && value !== null);
  const text = new URLSearchParams(given).toString();
  return answered(BASE + path + (text && `?${text}`), {});
}

function send(method, path, body, headers = {}) {
  return answered(BASE + path, {
    method,
    headers: { "X-Lippmann-Request": "1", ...(body && { "Content-Type": "application/json" }), ...headers },
    body: body && JSON.stringify(body),
  });
}

async function answered(url, request) {
  let response;
  try {
    response = await fetch(url, { credentials: "same-origin", signal: AbortSignal.timeout(20_000), ...request });
  } catch {
    throw new Unreachable();
  }
  const type = response.headers.get("Content-Type") || "";
  const body = /json/.test(type) ? await response.json() : /svg/.test(type) ? await response.text() : {};
  if (response.status === 401 && url !== "/login") location.reload(); // The session ended: the service asks for a key.
  if (!response.ok && response.type !== "opaqueredirect") throw new Problem(response.status, body);
  return body;
}
