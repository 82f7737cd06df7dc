// A choice of one of several values, as a row of radios.
import { html } from "./html.js";

export const Choice = ({ name, choices, chosen, choose }) => html`
  <div class="choice" role="radiogroup" aria-label=${name}>
    ${choices.map(
      ([value, title]) => html`
        <label key=${value}>
          <input type="radio" name=${name} checked=${value === chosen} onChange=${() => choose(value)} />
          <span>${title}</span>
        </label>
      `,
    )}
  </div>
`;
