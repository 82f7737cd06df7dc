// Jobs to begin with. Each replaces the whole job of the form.
import { html } from "../shared/html.js";
import { isSame } from "./job_file.js";

const FIRST = "A preset fills in the whole form, and can be changed then.";

export function Presets({ presets, job, setJob }) {
  const chosen = presets.find((preset) => isSame(preset.job, job));
  return html`
    <div class="presets" role="group" aria-label="Presets">
      <div class="choice">
        ${presets.map(
          (preset) => html`
            <button type="button" key=${preset.name} aria-pressed=${preset === chosen} title=${preset.description}
              onClick=${() => setJob(preset.job)}>${preset.title}</button>
          `,
        )}
      </div>
      <p class="help" role="status">${chosen?.description || FIRST}</p>
    </div>
  `;
}
