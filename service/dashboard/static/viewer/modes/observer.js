// Observer: what one eye or two see of the display, made by the service.
import { Choice } from "../../shared/choice.js";
import { count, percent } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Apart, Eyes, inRange } from "../hand/eyes.js";
import { ownShare, zoneOf } from "../observed.js";
import { EYES } from "../painting/stereo.js";

const SEEN_PX = 480; // The longer side of the picture of one eye.
const EYE_STEP_MM = 10;
const GAPS = [
  ["focal", "Focal length"],
  ["real", "Real"],
  ["virtual", "Virtual"],
  ["own", "In mm"],
];

export const observer = {
  name: "as an observer sees it",
  hint: "Drag, or press the arrow keys, to turn the scene.",
  filled: (frameViews, stand) => ({
    ...stand,
    eye: { ...stand.eye, z: stand.eye.z ?? frameViews.viewing_distance_mm },
    gap_mm: stand.gap_mm ?? frameViews.gap_mm,
  }),
  query: ({ stand: { eye, eyes, apart_mm, pupil_mm, focus_mm, gap, gap_mm } }) => [
    "observer",
    {
      ...eye,
      ...(eyes !== "one" && { stereo: eyes, eye_distance_mm: apart_mm }),
      pupil_mm,
      focus_mm,
      ...(gap === "own" ? { gap_mm } : gap !== "focal" && { gap }),
      size: SEEN_PX,
    },
  ],
  stepped: ({ stand: { eye } }, [across, down]) => ({
    eye: { ...eye, x: eye.x - across * EYE_STEP_MM, y: eye.y + down * EYE_STEP_MM },
  }),
  // A drag over the whole picture moves the eye through the viewing zone; the scene follows the hand.
  dragged: ({ frameViews, stand: { eye } }, across, down) => {
    const zone_mm = zoneOf(frameViews, frameViews.gap_mm, eye.z);
    return { eye: { ...eye, x: Math.round(eye.x - across * zone_mm), y: Math.round(eye.y + down * zone_mm) } };
  },
  said: ({ frameViews, stand: { eye, eyes, apart_mm, gap, gap_mm } }) => {
    if (gap === "real" || gap === "virtual") return EYES.find(([kind]) => kind === eyes)[1].toLowerCase();
    const used_mm = gap === "own" ? gap_mm : frameViews.gap_mm;
    const own = ownShare(frameViews, eye, used_mm, eyes === "one" ? 0 : apart_mm);
    const zone = `viewing zone ±${count(Math.round(zoneOf(frameViews, used_mm, eye.z) / 2))} mm`;
    return `${zone}, crosstalk at ${percent(1 - own)} of the lenses`;
  },
  Controls: ({ frameViews, stand, change }) => {
    const eye = (axis) => (value) => change({ eye: { ...stand.eye, [axis]: value } });
    const put = (name) => (value) => change({ [name]: value });
    return html`
      <${Eyes} stand=${stand} change=${change} />
      ${stand.eyes !== "one" && html`<${Apart} stand=${stand} change=${change} />`}
      <div class="fields">
        <${Field} label="right" value=${stand.eye.x} put=${eye("x")} help="of the middle of the display" />
        <${Field} label="up" value=${stand.eye.y} put=${eye("y")} help="of the middle of the display" />
        <${Field} label="away" value=${stand.eye.z} put=${eye("z")} min="1" help="from the display to the eye" />
        <${Field} label="pupil" value=${stand.pupil_mm} put=${put("pupil_mm")} min="0.1" max="100" step="any"
          help="A wider pupil blurs and mixes more pixels." />
        <${Field} label="eye focuses at" value=${stand.focus_mm} put=${put("focus_mm")}
          help="in front of the display; 0 is on the lenses" />
        <div class="field">
          <${Choice} name="Gap" choices=${GAPS} chosen=${stand.gap} choose=${(gap) => change({ gap })} />
          <span class="quiet">from the pixels to the lenses; it suits real images, virtual ones, or neither</span>
        </div>
        ${
          stand.gap === "own" &&
          html`<${Field} label="gap" value=${stand.gap_mm} put=${put("gap_mm")} min="0.01" max="1000" step="any"
            help="reduced: glass divided by its index; f is ${frameViews.gap_mm}" />`
        }
      </div>
    `;
  },
};

const Field = ({ label, value, put, help, ...range }) => html`
  <label class="field">
    <span class="mm">
      <span>${label}</span>
      <input type="number" step="1" ...${range} value=${value}
        onInput=${(event) => inRange(event) && put(event.target.valueAsNumber)} />
      <span class="quiet">mm</span>
    </span>
    <span class="quiet">${help}</span>
  </label>
`;
