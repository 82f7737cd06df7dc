// A slider beside the input of a number.
import { html } from "../../shared/html.js";

const STEPS = 200; // The steps of a slider over its range.

/**
 * @param {{
 *   label: string,
 *   range: { least: number, most: number, isInteger?: boolean },
 *   value: number,
 *   put: (value: number) => void,
 * }} of
 */
export function Slider({ label, range, value, put }) {
  const step = range.isInteger ? 1 : stepOf(range);
  return html`
    <input type="range" aria-label=${`${label}, slider`} min=${range.least} max=${range.most} step=${step}
      value=${value} onInput=${(event) => put(Number(event.target.value))} />
  `;
}

// A round step, so that the slider says short numbers.
const stepOf = ({ least, most }) => 10 ** Math.floor(Math.log10((most - least) / STEPS));
