// The inputs of the form: one for each kind of a simple field. Each changes the job at its path.
import { html } from "../../shared/html.js";
import { Animate, Animated } from "../animation/animated.js";
import { faultsAt } from "./faults.js";
import { described, Help, unitOf } from "./help.js";
import { isSame, numberOf, numbersOf, textOf, valueAt } from "../job_file.js";
import { isAnimated } from "../animation/keyframes.js";
import { Slider } from "./slider.js";
import { Input } from "./text_input.js";

const FEW = 4; // Up to so many choices are radio buttons.

// `form` is {job, set(path, value), faults, hints, animation}: `hints` are the values that count when the job says
// none, by path; `animation` is the rule which numbers may change with the frame.
export function Simple({ field, path, form }) {
  const value = valueAt(form.job, path);
  if (isAnimated(value)) return html`<${Animated} ...${{ field, path, form, value }} />`;
  const Input = { flag: Flag, choice: Choices, set: Several, tuple: Numbers }[field.kind] || Text;
  return html`<${Input} ...${{ field, path, form, value, said: faultsAt(form.faults, path) }} />`;
}

const hintOf = (field, path, form) => valueAt(form.hints, path) ?? field.fallback;

function Text({ field, path, form, value, said }) {
  const isNumeric = field.kind === "number";
  const read = { number: numberOf, values: field.isNumber ? numbersOf : textsOf }[field.kind] || plainText;
  const shown = value ?? hintOf(field, path, form);
  const list = field.examples?.length && field.kind === "text" ? `l-${path}` : null;
  return html`
    <div class="field ${isNumeric ? "" : "wide"}">
      <label for="f-${path}">${field.label}${unitOf(field)}</label>
      <${Animate} ...${{ label: field.label, path, form, value: shown }} />
      <${Input} id=${path} value=${value} hint=${hintOf(field, path, form)} isNumeric=${isNumeric} list=${list}
        put=${(text) => form.set(path, read(text))} aria-invalid=${said.length ? "true" : null}
        aria-describedby=${described(path, field, said)} />
      ${list && html`<datalist id=${list}>${field.examples.map((one) => html`<option value=${one} />`)}</datalist>`}
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
      ${
        field.slider &&
        typeof shown === "number" &&
        html`<${Slider} label=${field.label} range=${field.slider} value=${shown}
          put=${(one) => form.set(path, one)} />`
      }
    </div>
  `;
}

const plainText = (text) => (text === "" ? undefined : text);
const textsOf = (text) => {
  const parts = text.split(/[,\s]+/).filter(Boolean);
  return parts.length ? parts : undefined;
};

// Several numbers that belong together, as rows and columns.
function Numbers({ field, path, form, value, said }) {
  const hint = hintOf(field, path, form);
  const put = (place) => (text) => {
    const all = [...(value ?? hint ?? field.items.map(() => null))];
    const number = numberOf(text) ?? hint?.[place] ?? null;
    form.set(
      path,
      all.map((one, other) => (other === place ? number : one)),
    );
  };
  const replace = (place) => (one) => {
    const all = [...(value ?? hint)];
    all[place] = one;
    form.set(path, all);
  };
  const labelOf = (item) => `${field.label} ${item.label}`;
  const animated = field.items.map((_, place) => isAnimated(value?.[place]));
  const input = (item, place) =>
    !animated[place] &&
    html`
    <label key=${place}>
      <span class="quiet">${item.label}</span>
      <${Input} id="${path}.${place}" value=${value?.[place]} hint=${hint?.[place]} isNumeric put=${put(place)}
        aria-invalid=${said.length ? "true" : null} aria-describedby=${described(path, field, said)} />
    </label>
  `;
  return html`
    <fieldset class="field wide tuple">
      <legend>${field.label}${unitOf(field)}</legend>
      <div>${field.items.map(input)}</div>
      ${field.items.map((item, place) => {
        const one = { label: labelOf(item), path: `${path}.${place}`, form, put: replace(place) };
        if (!animated[place]) return html`<${Animate} ...${one} value=${(value ?? hint)?.[place]} />`;
        return html`<${Animated} ...${one} field=${{ ...item, unit: field.unit, label: one.label }}
          value=${value[place]} />`;
      })}
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
    </fieldset>
  `;
}

function Flag({ field, path, form, value, said }) {
  const isOn = value ?? hintOf(field, path, form) ?? false;
  return html`
    <div class="field flag">
      <label>
        <input type="checkbox" checked=${isOn} aria-describedby=${described(path, field, said)}
          onChange=${(event) => form.set(path, event.target.checked)} /> ${field.label}
      </label>
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
    </div>
  `;
}

// A choice of one value. A field that may be absent has the choice "default", which removes it.
function Choices({ field, path, form, value, said }) {
  const chosen = value ?? field.fallback;
  const all = [...(field.isOptional && field.fallback === null ? [null] : []), ...field.choices];
  const put = (one) => form.set(path, one ?? undefined);
  const nameOf = (one) => (one === null ? "default" : String(one).replaceAll("_", " "));
  if (all.length <= FEW) {
    const options = all.map((one) => [one, nameOf(one)]);
    return html`<${Radios} ...${{ field, path, said, options, put }} isChosen=${(one) => isSame(one, chosen)} />`;
  }
  return html`
    <div class="field">
      <label for="f-${path}">${field.label}</label>
      <select id="f-${path}" aria-describedby=${described(path, field, said)} value=${nameOf(chosen)}
        onChange=${(event) => put(all[event.target.selectedIndex])}>
        ${all.map((one) => html`<option selected=${isSame(one, chosen)}>${nameOf(one)}</option>`)}
      </select>
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
    </div>
  `;
}

// `options` are [value, title]; `put` gets the chosen value.
export function Radios({ field, path, said, options, put, isChosen }) {
  return html`
    <fieldset class="field wide" aria-describedby=${described(path, field, said)}>
      <legend>${field.label}${unitOf(field)}</legend>
      <div class="radios">
        ${options.map(
          ([one, title]) => html`
          <label key=${title}>
            <input type="radio" name=${`f-${path}`} checked=${isChosen(one)} onChange=${() => put(one)} /> ${title}
          </label>
        `,
        )}
      </div>
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
    </fieldset>
  `;
}

function Several({ field, path, form, value, said }) {
  const chosen = value ?? field.fallback ?? [];
  const put = (one, isOn) => {
    const now = field.choices.filter((other) => (other === one ? isOn : chosen.includes(other)));
    form.set(path, now.length ? now : undefined);
  };
  return html`
    <fieldset class="field wide" aria-describedby=${described(path, field, said)}>
      <legend>${field.label}</legend>
      <div class="radios">
        ${field.choices.map(
          (one) => html`
          <label key=${one}>
            <input type="checkbox" checked=${chosen.includes(one)}
              onChange=${(event) => put(one, event.target.checked)} /> ${one}
          </label>
        `,
        )}
      </div>
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
    </fieldset>
  `;
}
