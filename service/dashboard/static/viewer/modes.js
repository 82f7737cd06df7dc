// The modes of the interactive view. Each mode defines, for {frameViews, stand}: the defaults (`filled`), the picture
// of the service that shows it (`query`), the effect of an arrow key and of a drag (`stepped`, `dragged`), how the
// graphics card draws it (`paint`), its description (`said`), and its controls (`Controls`).
import { Choice } from "../shared/choice.js";
import { by, count, quantity } from "../shared/format.js";
import { html } from "../shared/html.js";
import { clamp, nearestView, nextPlace, numbersAt, placeOf } from "./views.js";

export const START = {
  place: null, // the position of the eye among the views; see views.js
  isSwaying: !matchMedia("(prefers-reduced-motion: reduce)").matches,
  isSmooth: true,
  depth_mm: null,
  eye: { x: 0, y: 0, z: null }, // mm
  eyes: "one",
};
const EYES = [
  ["one", "One eye"],
  ["anaglyph", "Red-cyan"],
  ["side_by_side", "Side by side"],
];
const ENLARGEMENTS = [
  [true, "Smooth"],
  [false, "Pixels"],
];
const SEEN_PX = 480; // The longer side of the picture of one eye.
const EYE_STEP_MM = 10;

export const around = {
  name: "looked around",
  hint: "Drag, or press the arrow keys, to move the eye.",
  filled: (frameViews, stand) => ({ ...stand, place: stand.place ?? placeOf(frameViews, ...frameViews.centre) }),
  query: ({ frameViews, stand }) => {
    const [u, v] = nearestView(frameViews, stand.place);
    return ["view", { u, v }];
  },
  stepped: ({ frameViews, stand }, direction) => ({ place: nextPlace(frameViews, stand.place, direction) }),
  dragged: ({ stand: { place } }, across, down) => ({
    place: { x: clamp(place.x + 2 * across), y: clamp(place.y + 2 * down) },
  }),
  paint: (painter, place, { isSmooth }) => painter.around(place, isSmooth),
  said: ({ frameViews, stand, isPainted }) => {
    const [u, v] = isPainted ? numbersAt(frameViews, stand.place) : nearestView(frameViews, stand.place);
    return `view ${u.toFixed(1)}, ${v.toFixed(1)} of ${by(frameViews.us, frameViews.vs)}`.replaceAll(".0", "");
  },
  Controls: ({ stand, change, pause, isPainted }) => html`
    ${
      isPainted &&
      html`
      <button aria-pressed=${stand.isSwaying} class="toggle"
        onClick=${() => (stand.isSwaying ? pause() : change({ isSwaying: true }))}>Sway</button>
    `
    }
    <${Enlargement} stand=${stand} change=${change} />
    <span class="quiet">Drag or press arrow keys.</span>
  `,
};

export const refocus = {
  name: "refocused",
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

export const seen = {
  name: "as seen",
  hint: "Drag, or press the arrow keys, to move the eye.",
  filled: (frameViews, stand) => ({
    ...stand,
    eye: { ...stand.eye, z: stand.eye.z ?? frameViews.viewing_distance_mm },
  }),
  query: ({ stand: { eye, eyes } }) => ["observer", { ...eye, stereo: eyes === "one" ? null : eyes, size: SEEN_PX }],
  stepped: ({ stand: { eye } }, [across, down]) => ({
    eye: { ...eye, x: eye.x + across * EYE_STEP_MM, y: eye.y - down * EYE_STEP_MM },
  }),
  // A drag over the whole picture moves the eye through the viewing zone.
  dragged: ({ frameViews, stand: { eye } }, across, down) => {
    const zone_mm = (frameViews.pitch_mm * eye.z) / frameViews.gap_mm;
    return { eye: { ...eye, x: Math.round(eye.x + across * zone_mm), y: Math.round(eye.y - down * zone_mm) } };
  },
  said: ({ frameViews, stand: { eye } }) =>
    `viewing zone ±${count((frameViews.pitch_mm * eye.z) / frameViews.gap_mm / 2)} mm`,
  Controls: ({ stand, change }) => {
    const put = (axis) => (event) => {
      const number = event.target.valueAsNumber;
      if (event.target.validity.valid && Number.isFinite(number)) change({ eye: { ...stand.eye, [axis]: number } });
    };
    return html`
      <${Choice} name="Eyes" choices=${EYES} chosen=${stand.eyes} choose=${(eyes) => change({ eyes })} />
      <${Millimetres} label="right" value=${stand.eye.x} onInput=${put("x")} />
      <${Millimetres} label="up" value=${stand.eye.y} onInput=${put("y")} />
      <${Millimetres} label="away" value=${stand.eye.z} onInput=${put("z")} min="1" />
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

const Millimetres = ({ label, ...rest }) => html`
  <label class="mm">
    <span>${label}</span> <input type="number" step="1" ...${rest} /> <span class="quiet">mm</span>
  </label>
`;

const Enlargement = ({ stand, change }) => html`
  <${Choice} name="Enlargement" choices=${ENLARGEMENTS} chosen=${stand.isSmooth}
    choose=${(isSmooth) => change({ isSmooth })} />
`;
