// A number with keyframes: its curve over the frames, and each keyframe as two numbers.
import { html } from "../../shared/html.js";
import { faultsAt } from "../form/faults.js";
import { Help, unitOf } from "../form/help.js";
import { numberOf } from "../job_file.js";
import {
  animationOf,
  freeFrame,
  mayChange,
  rounded,
  shownValues,
  spanOfFrames,
  valueAtFrame,
  withFrame,
  withKey,
  withoutKey,
} from "./keyframes.js";
import { Input } from "../form/text_input.js";
import { Timeline } from "./timeline.js";

const HOW = "Drag a keyframe, or move it with the arrow keys; a double click adds one, Delete removes one.";
/** @type {[number, number]} */
const STILL = [1, 1];

// The way from a constant to keyframes. A job of one frame has none.
/** @param {{ label: string, path: string, form: any, value: any, put?: (animation: any) => void }} of */
export function Animate({ label, path, form, value, put = (one) => form.set(path, one) }) {
  const span = spanOfFrames(form.job.frames);
  if (typeof value !== "number" || !span || span[0] === span[1] || !mayChange(form.animation, path)) return null;
  return html`
    <button type="button" class="plain animate" title="Let it change with the frame"
      onClick=${() => put(animationOf(value, span))}>Animate<span class="unseen"> ${label}</span></button>
  `;
}

/** @param {{ field: any, path: string, form: any, value: any, put?: (value: any) => void }} of */
export function Animated({ field, path, form, value, put = (one) => form.set(path, one) }) {
  const { label } = field;
  const span = spanOfFrames(form.job.frames) || STILL;
  const said = faultsAt(form.faults, path);
  const free = freeFrame(value, span);
  const add = () => put(withFrame(value, free, rounded(valueAtFrame(value, free), shownValues(value, field.slider))));
  const write = (place, key) => put(withKey(value, place, key));
  const interpolation = value.interpolation ?? "linear";
  const choose = (one) => {
    const { interpolation: _, ...others } = value;
    put(one === "linear" ? others : { ...others, interpolation: one });
  };
  const key = ([frame, number], place) => html`
    <li key=${place}>
      <label><span class="quiet">frame</span>
        <${Input} id="${path}.keyframes.${place}.0" value=${frame} isNumeric
          aria-label=${`${label}, keyframe ${place + 1}, frame`}
          put=${(text) => write(place, [numberOf(text) ?? "", number])} /></label>
      <label><span class="quiet">value</span>
        <${Input} id="${path}.keyframes.${place}.1" value=${number} isNumeric
          aria-label=${`${label}, keyframe ${place + 1}, value`}
          put=${(text) => write(place, [frame, numberOf(text) ?? ""])} /></label>
      <button type="button" class="plain" aria-label=${`Remove keyframe ${place + 1} of ${label}`}
        disabled=${value.keyframes.length < 2} onClick=${() => put(withoutKey(value, place))}>Remove</button>
    </li>
  `;
  return html`
    <fieldset class="field wide animated" aria-describedby=${said.length ? `e-${path}` : `h-${path}`}>
      <legend>${label}${unitOf(field)}</legend>
      <div class="radios">
        ${["linear", "smooth"].map(
          (one) => html`
          <label key=${one}><input type="radio" name=${`i-${path}`} checked=${interpolation === one}
            onChange=${() => choose(one)} /> ${one}</label>
        `,
        )}
        <button type="button" class="plain" onClick=${() => put(value.keyframes[0]?.[1])}>Make constant</button>
      </div>
      <${Timeline} ...${{ label, animation: value, span, slider: field.slider, put }} />
      <ol class="keys">${value.keyframes.map(key)}</ol>
      <p class="choices"><button type="button" disabled=${free === null} onClick=${add}>Add a keyframe</button></p>
      <${Help} id=${path} text=${HOW} said=${said} more="job-file.html#numbers-that-change-with-the-frame"
        label=${`keyframes of ${label}`} />
    </fieldset>
  `;
}
