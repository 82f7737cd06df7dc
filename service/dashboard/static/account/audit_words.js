// The entries of the audit log in words. Pure: no DOM, no Preact.

// The actions that the log can have, in the order of the choice.
export const ACTIONS = [
  "submit-job",
  "prioritise-job",
  "share-job",
  "cancel-job",
  "pause-job",
  "resume-job",
  "retry-job",
  "repair-job",
  "skip-frames",
  "restart-task",
  "end-task",
  "remove-job",
  "link-artifact",
  "upload-scene",
  "remove-scene",
  "create-key",
  "revoke-key",
  "create-worker-key",
  "create-login-link",
  "log-in",
  "log-out",
  "end-session",
  "drain-worker",
  "undrain-worker",
  "exclude-worker",
  "include-worker",
  "forgive-worker",
];

export const actionWords = (action) => action.replaceAll("-", " ");

// Where an entry leads: the page of its job, the keys, the farm, or null if there is no page of its subject.
export function pageOf({ action, subject }) {
  if (action === "remove-job" || !subject) return null;
  if (/-(job|frames)$/.test(action)) return `#/jobs/${encodeURIComponent(subject)}`;
  if (/-task$/.test(action)) return `#/jobs/${encodeURIComponent(subject.replace(/-\d+$/, ""))}`;
  if (/-worker$/.test(action)) return "#/farm";
  return action === "create-key" ? "#/keys" : null;
}

// The filter in the query of an address, as the API takes it; empty values are left out.
export function filterOf(query) {
  const given = ["action", "name", "subject"].map((name) => [name, (query.get(name) || "").trim()]);
  return Object.fromEntries(given.filter(([name, value]) => value && (name !== "action" || ACTIONS.includes(value))));
}
