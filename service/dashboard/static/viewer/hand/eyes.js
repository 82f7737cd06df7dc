// The choice of one eye or two, and their distance.
import { Choice } from "../../shared/choice.js";
import { html } from "../../shared/html.js";
import { Millimetres } from "./controls.js";
import { EYES, LEAST_APART_MM, MOST_APART_MM } from "../painting/stereo.js";

export const Eyes = ({ stand, change }) => html`
  <${Choice} name="Eyes" choices=${EYES} chosen=${stand.eyes} choose=${(eyes) => change({ eyes })} />
`;

export const Apart = ({ stand, change }) => html`
  <${Millimetres} label="Eyes apart" value=${stand.apart_mm} min=${LEAST_APART_MM} max=${MOST_APART_MM}
    title="The distance between the two eyes; 63 mm is the mean of adults."
    onInput=${(event) => inRange(event) && change({ apart_mm: event.target.valueAsNumber })} />
`;

// Whether an input has a number that its range allows; while somebody types, it may have none.
export const inRange = ({ target }) => target.validity.valid && Number.isFinite(target.valueAsNumber);
