// What the list of jobs shows: filters and order, in the address and in the request to the API.

// The orders by the names of the API: the title, and whether the lowest value comes first by default.
export const SORTS = {
  created: ["Submitted", false],
  name: ["Name", true],
  owner: ["Owner", true],
  status: ["Status", true],
  progress: ["Progress", false],
  time_left: ["Time left", true],
  cost: ["CPU time", false],
  priority: ["Priority", false],
  work: ["Order of work", true],
  frames: ["Frames", false],
};

// The choices of statuses: the title, and the statuses of the API.
export const STATUSES = {
  open: ["Open", ["queued", "probing", "running", "paused"]],
  ended: ["Ended", ["done", "failed", "cancelled"]],
  queued: ["Queued", ["queued"]],
  probing: ["Probing", ["probing"]],
  running: ["Running", ["running"]],
  paused: ["Paused", ["paused"]],
  done: ["Done", ["done"]],
  failed: ["Failed", ["failed"]],
  cancelled: ["Cancelled", ["cancelled"]],
};

const NAMES = ["search", "status", "owner", "sort", "ascending"];
const MOST_CHARS = 100;

// The filters and the order of an address; what an address says that is none of ours is left out.
export function parseQuery(params) {
  const text = (name) => (params.get(name) || "").slice(0, MOST_CHARS);
  const sort = Object.hasOwn(SORTS, text("sort")) ? text("sort") : "created";
  const said = params.get("ascending");
  return {
    search: text("search"),
    status: Object.hasOwn(STATUSES, text("status")) ? text("status") : "",
    owner: text("owner"),
    sort,
    ascending: said === "true" || (said !== "false" && SORTS[sort][1]),
  };
}

// What an address says of a query, null where it says nothing; the inverse of `parseQuery`.
export function addressOf(query) {
  return {
    search: query.search || null,
    status: query.status || null,
    owner: query.owner || null,
    sort: query.sort === "created" ? null : query.sort,
    ascending: query.ascending === SORTS[query.sort][1] ? null : String(query.ascending),
  };
}

// The address of a job beside which the list stays as it is.
export function hrefOf(id, query) {
  const given = Object.entries(addressOf(query)).filter(([, value]) => value !== null);
  const text = new URLSearchParams(given).toString();
  return `#/jobs/${encodeURIComponent(id)}${text && `?${text}`}`;
}

// The parameters of a request to the API.
export function requestOf(query) {
  return {
    status: query.status ? STATUSES[query.status][1] : undefined,
    owner: query.owner || undefined,
    search: query.search.trim() || undefined,
    sort: query.sort === "created" ? undefined : query.sort,
    ascending: query.ascending || undefined,
  };
}

// The names by which jobs of others are filtered, sorted: those of all owners that the service lists, those of the jobs
// that are loaded, which may be shared by owners who are not listed, and the one that the address asks for.
export function ownersOf(listed, jobs, { mine, asked }) {
  const names = new Set(listed.filter(({ owner_id }) => owner_id !== mine).map(({ name }) => name));
  for (const job of jobs) if (job.owner_id !== mine) names.add(job.owner);
  if (asked && asked !== mine) names.add(asked);
  return [...names].sort((one, other) => one.localeCompare(other));
}

// Whether two queries find the same jobs in the same order. There may be none yet.
export const isSame = (one, other) => Boolean(one && other) && hrefOf("", one) === hrefOf("", other);

export const isFiltered = (query) => Boolean(query.search.trim() || query.status || query.owner);

// Whether new jobs come first and nothing else changes the order.
export const isNewestFirst = (query) => !isFiltered(query) && query.sort === "created" && !query.ascending;

// Whether an address says anything of the list.
export const saysQuery = (params) => NAMES.some((name) => params.has(name));
