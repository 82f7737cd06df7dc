// Observer: what one eye or two see of the display, made by the service.
import { Choice } from "../../shared/choice.js";
import { count } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Millimetres } from "../controls.js";

const EYES = [
  ["one", "One eye"],
  ["anaglyph", "Red-cyan"],
  ["side_by_side", "Side by side"],
];
const SEEN_PX = 480; // The longer side of the picture of one eye.
const EYE_STEP_MM = 10;

export const observer = {
  name: "as an observer sees it",
  hint: "Drag, or press the arrow keys, to turn the scene.",
  filled: (frameViews, stand) => ({
    ...stand,
    eye: { ...stand.eye, z: stand.eye.z ?? frameViews.viewing_distance_mm },
  }),
  query: ({ stand: { eye, eyes } }) => ["observer", { ...eye, stereo: eyes === "one" ? null : eyes, size: SEEN_PX }],
  stepped: ({ stand: { eye } }, [across, down]) => ({
    eye: { ...eye, x: eye.x - across * EYE_STEP_MM, y: eye.y + down * EYE_STEP_MM },
  }),
  // A drag over the whole picture moves the eye through the viewing zone; the scene follows the hand.
  dragged: ({ frameViews, stand: { eye } }, across, down) => {
    const zone_mm = (frameViews.pitch_mm * eye.z) / frameViews.gap_mm;
    return { eye: { ...eye, x: Math.round(eye.x - across * zone_mm), y: Math.round(eye.y + down * zone_mm) } };
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
