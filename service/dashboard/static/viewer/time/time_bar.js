// The time of a sequence: play, speed, loop, and a slider over the frames that are done.
import { many } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { SPEEDS } from "./clock.js";

// `places` are those of the frame that is shown and of its neighbours among `frames`, which are done.
export function TimeBar({ frames, places, show, player, isSequence }) {
  if (!isSequence) return null;
  const { at, before, after } = places;
  const spoken = at < 0 ? "a frame that is not done" : `Frame ${frames[at]}, ${many(frames.length, "frame")}`;
  return html`
    <div class="bar time" role="group" aria-label="Time">
      <button class="play" onClick=${player.toggle} aria-label=${player.isPlaying ? "Pause" : "Play"}>
        ${player.isPlaying ? "❚❚" : "▶"}
      </button>
      <button onClick=${() => show(before)} aria-disabled=${before < 0} aria-label="Previous frame">←</button>
      <button onClick=${() => show(after)} aria-disabled=${after >= frames.length} aria-label="Next frame">
        →
      </button>
      <input
        type="range"
        min="0"
        max=${Math.max(1, frames.length - 1)}
        step="1"
        value=${at < 0 ? after : at}
        aria-label="Frame"
        aria-valuetext=${frames.length ? spoken : "no frame"}
        disabled=${frames.length < 2}
        onInput=${(event) => show(event.target.valueAsNumber)}
      />
      <label class="speed">
        <span class="unseen">Speed</span>
        <select value=${player.speed_fps} onChange=${(event) => player.setSpeed(Number(event.target.value))}>
          ${SPEEDS.map((fps) => html`<option key=${fps} value=${fps}>${fps} fps</option>`)}
        </select>
      </label>
      <label class="loop">
        <input type="checkbox" checked=${player.isLooping}
          onChange=${(event) => player.setLooping(event.target.checked)} />
        Loop
      </label>
    </div>
  `;
}
