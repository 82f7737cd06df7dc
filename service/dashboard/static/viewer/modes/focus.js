// Focus: the picture that is sharp at a depth, or at what is clicked.
import { getFocusDepth } from "../../api/operations.js";
import { count, quantity } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Enlargement } from "../hand/controls.js";
import { DepthOverlay, DepthToggle } from "../depth/depth_overlay.js";
import { scaleOf } from "../depth/depth_scale.js";
import { clamp } from "../painting/views.js";

export const focus = {
  name: "focused",
  needsAll: true,
  hint: "Click an object to focus on it, or press the arrow keys to change the depth.",
  filled: (frameViews, stand) => {
    const chosen_mm = stand.depth_mm ?? frameViews.depths.reference_mm ?? 0;
    const { least_mm, most_mm, rounded } = scaleOf(frameViews, stand.depth_mm);
    return { ...stand, depth_mm: clamp(rounded(chosen_mm), least_mm, most_mm) };
  },
  query: ({ stand }) => ["refocus", { depth_mm: stand.depth_mm }],
  stepped: ({ frameViews, stand }, [across, down]) => {
    const { least_mm, most_mm, step_mm, rounded } = scaleOf(frameViews, stand.depth_mm);
    const after_mm = rounded(stand.depth_mm + (across - down) * step_mm);
    return { depth_mm: clamp(after_mm, least_mm, most_mm), aim: null };
  },
  // The aim is what was clicked and what was found there; it is not in the address.
  clicked: async ({ job, frame, frameViews }, across, down) => {
    const place = { frame, x: across, y: down };
    try {
      const found = await getFocusDepth(job, frame, { x: across.toFixed(5), y: down.toFixed(5) });
      if (found.depth_mm === null) return { aim: { ...place, words: "Uniform here: there is nothing to focus on." } };
      const depth_mm = scaleOf(frameViews, found.depth_mm).rounded(found.depth_mm);
      return { depth_mm, aim: { ...place, words: wordsOf({ ...found, depth_mm }) } };
    } catch (error) {
      return { aim: { ...place, words: error.message } };
    }
  },
  paint: (painter, _place, { depth_mm, isSmooth }) => painter.focused(depth_mm, isSmooth),
  said: ({ stand }) => `sharp at ${quantity(stand.depth_mm)} mm`,
  Overlay: (given) => html`
    <${DepthOverlay} ...${given} movesEye=${false} />
    <${Aim} ...${given} />
  `,
  Controls: ({ frameViews, stand, change }) => {
    const { least_mm, most_mm, step_mm, rounded } = scaleOf(frameViews, stand.depth_mm);
    const ticks = [frameViews.depths.far_mm, 0, frameViews.depths.near_mm].filter((depth_mm) => depth_mm !== null);
    return html`
      <label class="slider">Depth
        <input type="range" min=${least_mm} max=${most_mm} step=${step_mm} value=${stand.depth_mm} list="look-depths"
          aria-valuetext="${quantity(stand.depth_mm)} mm"
          onInput=${(event) => change({ depth_mm: event.target.valueAsNumber, aim: null })} />
        <output class="numbers">${quantity(stand.depth_mm)} mm</output>
      </label>
      <datalist id="look-depths">${ticks.map((depth_mm) => html`<option value=${rounded(depth_mm)} />`)}</datalist>
      <${DepthToggle} stand=${stand} change=${change} />
      <${Enlargement} stand=${stand} change=${change} />
    `;
  },
};

function wordsOf({ depth_mm, source, scene_mm }) {
  const side = depth_mm < 0 ? "behind" : "in front of";
  const where = `${quantity(Math.abs(depth_mm))} mm ${side} the display`;
  return source === "truth" ? `${where}, ${count(Math.round(scene_mm))} mm away in the scene` : `${where}, estimated`;
}

// A ring around what was clicked, and what was found there.
function Aim({ stand, frame, frameViews, styleOf }) {
  const aim = stand.aim?.frame === frame ? stand.aim : null;
  if (!frameViews) return null;
  return html`
    <div class="aim" style=${styleOf({ width: frameViews.view_cols, height: frameViews.view_rows })}>
      ${aim && html`<span class="ring" style=${{ left: `${100 * aim.x}%`, top: `${100 * aim.y}%` }}></span>`}
    </div>
    <p class="found" role="status">${aim?.words}</p>
  `;
}
