// Focus: the picture that is sharp at a depth.
import { quantity } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Enlargement } from "../controls.js";
import { clamp } from "../views.js";

export const focus = {
  name: "focused",
  needsAll: true,
  hint: "Press the arrow keys to change the depth.",
  filled: (frameViews, stand) => {
    const { least_mm, most_mm, rounded } = scaleOf(frameViews);
    const depth_mm = rounded(stand.depth_mm ?? frameViews.depths.reference_mm ?? 0);
    return { ...stand, depth_mm: clamp(depth_mm, least_mm, most_mm) };
  },
  query: ({ stand }) => ["refocus", { depth_mm: stand.depth_mm }],
  stepped: ({ frameViews, stand }, [across, down]) => {
    const { least_mm, most_mm, step_mm, rounded } = scaleOf(frameViews);
    return { depth_mm: clamp(rounded(stand.depth_mm + (across - down) * step_mm), least_mm, most_mm) };
  },
  paint: (painter, _place, { depth_mm, isSmooth }) => painter.focused(depth_mm, isSmooth),
  said: ({ stand }) => `sharp at ${quantity(stand.depth_mm)} mm`,
  Controls: ({ frameViews, stand, change }) => {
    const { least_mm, most_mm, step_mm, rounded } = scaleOf(frameViews);
    const ticks = [frameViews.depths.far_mm, 0, frameViews.depths.near_mm].filter((depth_mm) => depth_mm !== null);
    return html`
      <label class="slider">Depth
        <input type="range" min=${least_mm} max=${most_mm} step=${step_mm} value=${stand.depth_mm} list="look-depths"
          aria-valuetext="${quantity(stand.depth_mm)} mm"
          onInput=${(event) => change({ depth_mm: event.target.valueAsNumber })} />
        <output class="numbers">${quantity(stand.depth_mm)} mm</output>
      </label>
      <datalist id="look-depths">${ticks.map((depth_mm) => html`<option value=${rounded(depth_mm)} />`)}</datalist>
      <${Enlargement} stand=${stand} change=${change} />
    `;
  },
};

// The range of the depth slider: about a hundred round steps.
function scaleOf({ depths: { from_mm, to_mm } }) {
  const step_mm = 10 ** Math.ceil(Math.log10(Math.max(to_mm - from_mm, 1e-3) / 200)) / 2;
  const steps = (count) => Number((count * step_mm).toPrecision(9));
  return {
    step_mm,
    least_mm: steps(Math.ceil(from_mm / step_mm)),
    most_mm: steps(Math.floor(to_mm / step_mm)),
    rounded: (depth_mm) => steps(Math.round(depth_mm / step_mm)),
  };
}
