// Where the documentation explains what the form shows: pages of the service below /help/. Pure: no DOM.
//
// The tables of the documentation have an anchor for each name in their first column, and a test of the service holds
// that the table of the job file has a row for each field, and the page of outputs a heading for each kind.

export const pageOf = (path) => `job-file.html#${path}`;
export const pageOfOutput = (kind) => `outputs.html#${kind}`;
export const pageOfNumber = (name) => `designer.html#${name}`;
