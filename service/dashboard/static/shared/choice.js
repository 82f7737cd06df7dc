// A choice of one of several values, as a row of buttons.
import { html } from "./html.js";

export const Choice = ({ name, choices, chosen, choose }) => html`
  <div class="choice" role="group" aria-label=${name}>
    ${choices.map(
      ([value, title]) => html`
      <button key=${value} aria-pressed=${value === chosen} onClick=${() => choose(value)}>${title}</button>
    `,
    )}
  </div>
`;
