// A job file as the form changes it: values by their path, as text and back. Pure: no DOM.

export const valueAt = (job, path) =>
  path.split(".").reduce((place, name) => (place === null || place === undefined ? undefined : place[name]), job);

// Returns the job with another value at a path; undefined removes the value, and the objects that are empty then.
export function withValue(job, path, value) {
  const [name, ...rest] = path.split(".");
  const inner = rest.length ? withValue(containerOf(job?.[name]), rest.join("."), value) : value;
  const isGone = inner === undefined || (rest.length && isEmpty(inner));
  if (Array.isArray(job)) {
    const copy = [...job];
    if (inner === undefined) copy.splice(Number(name), 1);
    else copy[Number(name)] = inner;
    return copy;
  }
  const { [name]: _, ...others } = job || {};
  // The order of the fields stays as it was.
  return isGone ? others : { ...(name in (job || {}) ? job : others), [name]: inner };
}

const containerOf = (value) => (typeof value === "object" && value !== null ? value : {});
const isEmpty = (value) =>
  typeof value === "object" && !Array.isArray(value) && value !== null && !Object.keys(value).length;

// The number that a text says. Other texts are kept unchanged, so that the service says what it expects; nothing for an
// empty one.
export function numberOf(text) {
  const bare = text.trim();
  if (bare === "") return undefined;
  return Number.isFinite(Number(bare)) ? Number(bare) : text;
}

export const numbersOf = (text) => {
  const parts = text.split(/[,\s]+/).filter(Boolean);
  return parts.length ? parts.map(numberOf) : undefined;
};

// A value as the text of an input.
export function textOf(value) {
  if (value === null || value === undefined) return "";
  return Array.isArray(value) ? value.join(", ") : String(value);
}

// A stored job as a job file: keyframes in place of their numbers, and nothing that says what is said without it.
export function jobFileOf(spec, defaults = {}) {
  const { animation = {}, ...rest } = withoutNull(spec);
  const own = Object.entries(rest).filter(([name, value]) => !isSame(value, withoutNull(defaults[name])));
  return Object.entries(animation).reduce(
    (job, [path, keyframes]) => withValue(job, path, keyframes),
    Object.fromEntries(own),
  );
}

// Null is left out but where it says something: without an imaging lens the array stands in the space of the scene.
const SAYS_NONE = new Set(["imaging_lens", "radius_mm"]);

function withoutNull(value) {
  if (Array.isArray(value)) return value.map(withoutNull);
  if (typeof value !== "object" || value === null) return value;
  const kept = Object.entries(value).filter(([name, inner]) => inner !== null || SAYS_NONE.has(name));
  return Object.fromEntries(kept.map(([name, inner]) => [name, withoutNull(inner)]));
}

export function isSame(one, other) {
  if (one === other) return true;
  if (typeof one !== "object" || typeof other !== "object" || one === null || other === null) return false;
  const names = Object.keys(one);
  return names.length === Object.keys(other).length && names.every((name) => isSame(one[name], other[name]));
}

export const jsonOf = (job) => JSON.stringify(job, null, 2);

// Returns {job} or {fault}.
export function jobOfJson(text) {
  try {
    const job = JSON.parse(text);
    const isJob = typeof job === "object" && job !== null && !Array.isArray(job);
    return isJob ? { job } : { fault: 'A job file is a JSON object, such as {"scene": "fish"}.' };
  } catch (error) {
    return { fault: `This is not JSON yet: ${error.message}` };
  }
}
