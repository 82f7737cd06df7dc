// The address of the page. The fragment of the URL names a view, and the query behind it the state inside the view:
//   #/   #/new   #/account   #/keys   #/audit   #/farm   #/jobs/ID?frame=3&look=focus   #/compare/ID/ID

// For the first word of a fragment: the view, and the number of ids that follow.
const VIEWS = {
  "": ["list", 0],
  new: ["new", 0],
  account: ["account", 0],
  keys: ["keys", 0],
  audit: ["audit", 0],
  farm: ["farm", 0],
  jobs: ["job", 1],
  compare: ["compare", 2],
};
const CHANGED = "addresschange";

// The view, ids and query of a fragment. `id` is the first id; the view of a wrong fragment is "wrong".
export function parse(fragment) {
  const [path, text = ""] = cut(fragment.replace(/^#/, ""), "?");
  const [, first = "", ...rest] = path.split("/");
  const [view, number] = Object.hasOwn(VIEWS, first) ? VIEWS[first] : ["wrong", 0];
  const ids = rest.map(decoded).filter(Boolean);
  return { view: ids.length === number ? view : "wrong", id: ids[0], ids, query: new URLSearchParams(text) };
}

// A fragment with other values in its query; null or undefined removes a value.
export function patched(fragment, patch) {
  const [path, text = ""] = cut(fragment.replace(/^#/, "") || "/", "?");
  const query = new URLSearchParams(text);
  for (const [name, value] of Object.entries(patch)) {
    if (value === null || value === undefined) query.delete(name);
    else query.set(name, value);
  }
  const rest = query.toString();
  return `#${path}${rest && `?${rest}`}`;
}

export const read = () => parse(location.hash);

// Changes the query of the present address. It replaces the address, or begins an entry of the history.
export function write(patch, { replace = true } = {}) {
  const after = patched(location.hash, patch);
  if (after === (location.hash || "#/")) return;
  if (replace) history.replaceState(history.state, "", after);
  else history.pushState(null, "", after);
  dispatchEvent(new Event(CHANGED));
}

// Calls `changed` after every change of the address; returns a function that ends this.
export function watch(changed) {
  const events = ["hashchange", "popstate", CHANGED];
  for (const event of events) addEventListener(event, changed);
  return () => events.forEach((event) => removeEventListener(event, changed));
}

function cut(text, mark) {
  const at = text.indexOf(mark);
  return at < 0 ? [text] : [text.slice(0, at), text.slice(at + 1)];
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // "%" without digits is no address of ours, and no reason to fail.
  }
}
