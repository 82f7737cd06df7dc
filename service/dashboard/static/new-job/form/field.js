// One input of a form with its label and the errors of the service.
import { html } from "../../shared/html.js";

export function Field({ name, label, unit, hint, faults = [], wide, ...rest }) {
  const saying = faults.length > 0;
  return html`
    <p class="field ${wide ? "wide" : ""}">
      <label for="f-${name}">${label}${unit && html` <span class="quiet">${unit}</span>`}</label>
      <input id="f-${name}" name=${name} placeholder=${hint || null} autocomplete="off" spellcheck=${false} ...${rest}
        aria-invalid=${saying ? "true" : null} aria-describedby=${saying ? `e-${name}` : null} />
      ${saying && html`<span class="fault" id="e-${name}">${faults.join("; ")}</span>`}
    </p>
  `;
}

// Converts a text to a number; other texts are sent unchanged, so that the service reports what it expects.
export const numberOr = (text) => (text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : text);
