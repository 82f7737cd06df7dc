// The scene of a new job, chosen from pictures in a strip of constant height. A scene without a poster has the picture
// of its preview.
import { link } from "../../api/operations.js";
import { html } from "../../shared/html.js";
import { Shot } from "../preview.js";

export function Scenes({ scenes, chosen, choose, said, pictures, children }) {
  const scene = scenes?.find(({ name }) => name === chosen);
  return html`
    <div class="scenes wide" role="radiogroup" aria-label="Scene">
      <div class="strip">
        ${scenes?.map(
          ({ name, title, poster }) => html`
          <label key=${name} class="scene">
            <input type="radio" name="scene" checked=${name === chosen} onChange=${() => choose(name)} />
            ${
              poster
                ? html`<img src=${link(poster)} alt="" width="132" height="132" />`
                : pictures[name]
                  ? html`<${Shot} bitmap=${pictures[name]} />`
                  : html`<span class="lattice"></span>`
            }
            <span>${title}</span>
          </label>
        `,
        )}
        ${!scenes && html`<p class="quiet">Loading …</p>`}
      </div>
      <p class="quiet about">${scene?.description}</p>
      ${children}
      ${said.map((text) => html`<p class="fault">${text}</p>`)}
    </div>
  `;
}
