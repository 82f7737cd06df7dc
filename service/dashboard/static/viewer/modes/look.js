// Look: one eye or two move among the views.
import { by, quantity } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Enlargement } from "../hand/controls.js";
import { DepthOverlay, DepthToggle } from "../depth/depth_overlay.js";
import { Apart, Eyes } from "../hand/eyes.js";
import { turned } from "../hand/motion.js";
import { roundedPlace } from "../stand.js";
import { eyeAt, eyePair, viewsApart } from "../painting/stereo.js";
import { nearestView, nextPlace, numbersAt, placeOf } from "../painting/views.js";

const PAIR_PX = 720; // The longer side of the picture of one eye of two that the service makes.

export const look = {
  name: "looked around",
  hint: "Drag, or press the arrow keys, to turn the scene. Plus and minus zoom.",
  movesEye: true,
  filled: (frameViews, stand) => ({ ...stand, place: stand.place ?? placeOf(frameViews, ...frameViews.centre) }),
  // The service shows two eyes of an observer who stands where these views are seen from.
  query: ({ frameViews, stand }) => {
    if (stand.eyes !== "one") {
      const pair = { stereo: stand.eyes, eye_distance_mm: stand.apart_mm, size: PAIR_PX };
      return ["observer", { ...eyeAt(frameViews, stand.place), ...pair }];
    }
    const [u, v] = nearestView(frameViews, stand.place);
    return ["view", { u, v }];
  },
  stepped: ({ frameViews, stand }, [across, down]) => ({
    place: roundedPlace(nextPlace(frameViews, stand.place, [-across, -down])),
  }),
  dragged: ({ stand: { place } }, across, down) => ({ place: roundedPlace(turned(place, across, down)) }),
  paint: (painter, place, stand, { frameViews }) => paintEyes(painter, frameViews, place, stand),
  said: ({ frameViews, stand, isPainted, isFree }) => {
    if (stand.eyes !== "one") {
      const apart = Math.min(frameViews.us - 1, viewsApart(frameViews, stand.apart_mm));
      return `eyes ${quantity(Number(apart.toFixed(1)))} of ${frameViews.us} views apart`;
    }
    if (isFree && isPainted) return by(frameViews.us, frameViews.vs) + " views";
    const [u, v] = isPainted ? numbersAt(frameViews, stand.place) : nearestView(frameViews, stand.place);
    return `view ${u.toFixed(1)}, ${v.toFixed(1)} of ${by(frameViews.us, frameViews.vs)}`.replaceAll(".0", "");
  },
  Overlay: (given) => given.stand.eyes === "one" && html`<${DepthOverlay} ...${given} movesEye=${true} />`,
  Controls: ({ stand, change, isPainted, isFree, hold }) => html`
    ${
      isPainted &&
      html`
        <button
          aria-pressed=${isFree}
          class="toggle"
          title="The eye follows the pointer, and sways while nobody steers it."
          onClick=${() => change({ place: isFree ? roundedPlace(hold()) : null })}
        >
          Follow
        </button>
      `
    }
    <${Eyes} stand=${stand} change=${change} />
    ${
      stand.eyes === "one"
        ? html`<${DepthToggle} stand=${stand} change=${change} />`
        : html`<${Apart} stand=${stand} change=${change} />`
    }
    <${Enlargement} stand=${stand} change=${change} />
  `,
};

function paintEyes(painter, frameViews, place, { eyes, apart_mm, isSmooth }) {
  if (eyes === "one") return painter.around(place, isSmooth);
  const [left, right] = eyePair(frameViews, place, apart_mm);
  if (eyes === "anaglyph") return painter.anaglyph(left, right, isSmooth);
  const width = Math.floor(painter.canvas.width / 2);
  const order = eyes === "cross_eyed" ? [right, left] : [left, right];
  return order.forEach((each, index) => {
    painter.into({ left: index * width, width, mask: [true, true, true] });
    painter.around(each, isSmooth);
  });
}
