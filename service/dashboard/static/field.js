// One input of a form with its label, and what the service said about it.
import { html } from "./html.js";

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

// Numbers go out as numbers; what is none goes out as it is, so that the service says what it expected.
export const numberOr = (text) => (text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : text);
