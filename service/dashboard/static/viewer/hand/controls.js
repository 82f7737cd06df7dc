// Controls that several modes have.
import { Choice } from "../../shared/choice.js";
import { html } from "../../shared/html.js";

const ENLARGEMENTS = [
  [true, "Smooth"],
  [false, "Pixels"],
];

export const Millimetres = ({ label, ...rest }) => html`
  <label class="mm">
    <span>${label}</span> <input type="number" step="1" ...${rest} /> <span class="quiet">mm</span>
  </label>
`;

export const Enlargement = ({ stand, change }) => html`
  <${Choice} name="Enlargement" choices=${ENLARGEMENTS} chosen=${stand.isSmooth}
    choose=${(isSmooth) => change({ isSmooth })} />
`;
