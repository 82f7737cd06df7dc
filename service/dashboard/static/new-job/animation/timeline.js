// The curve of a number over the frames, with keyframes that are moved by the pointer and by keys.
import { useRef, useState } from "preact/hooks";
import { quantity } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import {
  curveOf,
  moved,
  rounded,
  shownFrames,
  shownValues,
  stepOf,
  valueAtFrame,
  withFrame,
  withoutKey,
} from "./keyframes.js";

const FAR = 10; // The steps of a key with Shift.
const percent = (part) => `${100 * part}%`;

/**
 * @param {{
 *   label: string,
 *   animation: { keyframes: [number, number][], interpolation?: string },
 *   span: [number, number],
 *   slider?: { least: number, most: number, isInteger?: boolean },
 *   put: (animation: any) => void,
 * }} of
 */
export function Timeline({ label, animation, span, slider, put }) {
  const plot = useRef(null);
  const [held, setHeld] = useState(null); // While a keyframe is dragged, the plot keeps its range.
  const { frames, values } = held || { frames: shownFrames(animation, span), values: shownValues(animation, slider) };
  const [first, last] = frames;
  const [low, high] = values;
  const xOf = (frame) => (frame - first) / (last - first || 1);
  const yOf = (value) => (value - low) / (high - low || 1);
  /** @returns {[number, number]} */
  const keyAt = ({ clientX, clientY }) => {
    const box = plot.current.getBoundingClientRect();
    const [x, y] = [(clientX - box.left) / box.width, 1 - (clientY - box.top) / box.height];
    const inside = (part) => Math.min(1, Math.max(0, part));
    return [Math.round(first + inside(x) * (last - first)), rounded(low + inside(y) * (high - low), values)];
  };
  const step = slider?.isInteger ? 1 : stepOf(values);
  const press = (event, place) => {
    const [frame, value] = animation.keyframes[place];
    const far = event.shiftKey ? FAR : 1;
    const to = {
      ArrowLeft: [frame - far, value],
      ArrowRight: [frame + far, value],
      ArrowUp: [frame, rounded(value + far * step, values)],
      ArrowDown: [frame, rounded(value - far * step, values)],
    }[event.key];
    if (to) put(moved(animation, place, to, span));
    else if (event.key === "Delete" && animation.keyframes.length > 1) put(withoutKey(animation, place));
    else return;
    event.preventDefault();
  };
  const take = (event, place) => {
    event.target.setPointerCapture(event.pointerId);
    setHeld({ frames, values, place });
  };
  const drag = (event, place) => {
    if (held?.place === place) put(moved(animation, place, keyAt(event), span));
  };
  const add = (event) => {
    if (event.target.getAttribute("role") !== "slider") put(withFrame(animation, ...keyAt(event)));
  };
  const points = curveOf(animation, frames, values).map(([x, y]) => `${100 * x},${100 * (1 - y)}`);
  const key = ([frame, value], place) => html`
    <span key=${place} class="key" role="slider" tabindex="0" aria-label=${`${label}, keyframe ${place + 1}`}
      aria-valuenow=${frame} aria-valuemin=${first} aria-valuemax=${last}
      aria-valuetext=${`${quantity(value)} at frame ${frame}`} title=${`${value} at frame ${frame}`}
      style=${{ left: percent(xOf(frame)), bottom: percent(yOf(value)) }} onKeyDown=${(event) => press(event, place)}
      onPointerDown=${(event) => take(event, place)} onPointerMove=${(event) => drag(event, place)}
      onPointerUp=${() => setHeld(null)} onPointerCancel=${() => setHeld(null)}></span>
  `;
  const isKnown = ([frame, value]) => Number.isFinite(frame) && Number.isFinite(value);
  return html`
    <div class="timeline">
      <span class="bound high">${quantity(high)}</span>
      <span class="bound low">${quantity(low)}</span>
      <div class="plot" ref=${plot} onDblClick=${add}>
        <svg viewBox="0 0 100 100" preserveAspectRatio="none" role="img"
          aria-label=${`${label}: ${quantity(valueAtFrame(animation, first))} at frame ${first}, ${quantity(
            valueAtFrame(animation, last),
          )} at frame ${last}`}>
          <polyline points=${points.join(" ")} />
        </svg>
        ${animation.keyframes.map((one, place) => isKnown(one) && key(one, place))}
      </div>
      <span class="bound first">frame ${first}</span>
      <span class="bound last">${last}</span>
    </div>
  `;
}
