// Look: the eye moves among the views.
import { by } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Enlargement } from "../controls.js";
import { turned } from "../motion.js";
import { roundedPlace } from "../stand.js";
import { nearestView, nextPlace, numbersAt, placeOf } from "../views.js";

export const look = {
  name: "looked around",
  hint: "Drag, or press the arrow keys, to turn the scene. Plus and minus zoom.",
  movesEye: true,
  filled: (frameViews, stand) => ({ ...stand, place: stand.place ?? placeOf(frameViews, ...frameViews.centre) }),
  query: ({ frameViews, stand }) => {
    const [u, v] = nearestView(frameViews, stand.place);
    return ["view", { u, v }];
  },
  stepped: ({ frameViews, stand }, [across, down]) => ({
    place: roundedPlace(nextPlace(frameViews, stand.place, [-across, -down])),
  }),
  dragged: ({ stand: { place } }, across, down) => ({ place: roundedPlace(turned(place, across, down)) }),
  paint: (painter, place, { isSmooth }) => painter.around(place, isSmooth),
  said: ({ frameViews, stand, isPainted, isFree }) => {
    if (isFree && isPainted) return by(frameViews.us, frameViews.vs) + " views";
    const [u, v] = isPainted ? numbersAt(frameViews, stand.place) : nearestView(frameViews, stand.place);
    return `view ${u.toFixed(1)}, ${v.toFixed(1)} of ${by(frameViews.us, frameViews.vs)}`.replaceAll(".0", "");
  },
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
    <${Enlargement} stand=${stand} change=${change} />
  `,
};
