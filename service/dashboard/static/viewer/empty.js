// The viewer before there is a picture; it is as high as with one.
import { link } from "../api/operations.js";
import { Choice } from "../shared/choice.js";
import { html } from "../shared/html.js";
import { TITLES } from "./modes/index.js";
import { TimeBar } from "./time/time_bar.js";

const STILL = { isPlaying: false, speed_fps: 8, isLooping: true };
const NOWHERE = { at: -1, before: -1, after: 0 };

export function Empty({ job }) {
  if (job.ended_at && !job.frames_done) return null;
  const nothing = () => {};
  return html`
    <section class="looker" aria-label="Picture">
      <fieldset class="bar" disabled>
        <${Choice} name="Mode" choices=${TITLES} chosen="look" choose=${nothing} />
        <span class="ends"><button>Save</button><button>Full screen</button></span>
      </fieldset>
      <div class="stage">
        ${
          job.poster
            ? html`<img class="poster" src=${link(job.poster)} alt="" />`
            : html`<p class="soon">${job.ended_at ? "Loading …" : "The first frame appears here."}</p>`
        }
      </div>
      <fieldset disabled>
        <${TimeBar} frames=${[]} places=${NOWHERE} show=${nothing} player=${STILL} isSequence=${job.frames_total > 1} />
      </fieldset>
      ${job.frames_total > 1 && html`<div class="strip"></div>`}
      <div class="bar controls"></div>
    </section>
  `;
}
