// Look: the eye moves among the views.
import { by } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Enlargement } from "../controls.js";
import { clamp, nearestView, nextPlace, numbersAt, placeOf } from "../views.js";

export const look = {
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
