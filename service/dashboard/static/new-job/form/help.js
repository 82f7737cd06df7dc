// The explanation of a field, and what is wrong with its value.
import { html } from "../../shared/html.js";
import { Documented } from "./documented.js";

// Names in backticks are shown as code.
export const words = (text) => text.split("`").map((part, place) => (place % 2 ? html`<code>${part}</code>` : part));

// The explanation of a field, or in its place what is wrong with the value, so that nothing below moves; and the way to
// the documentation of the field.
/** @param {{ id: string, text?: string, said?: string[], more?: string, label?: string }} about */
export function Help({ id, text, said = [], more, label }) {
  const way = more && html` <${Documented} page=${more}>More<span class="unseen"> about ${label}</span><//>`;
  if (said.length) return html`<span class="fault" id="e-${id}">${said.join("; ")}${way}</span>`;
  return text ? html`<span class="help" id="h-${id}">${words(text)}${way}</span>` : null;
}

export const unitOf = ({ unit }) => unit && html` <span class="quiet">${unit}</span>`;

// The id of the text that describes the input of a field.
export const described = (path, { help }, said) => (said.length ? `e-${path}` : help ? `h-${path}` : null);
