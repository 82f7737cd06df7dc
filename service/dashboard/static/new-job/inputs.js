// The inputs of the form: one for each kind of a simple field. Each changes the job at its path.
import { useState } from "preact/hooks";
import { html } from "../shared/html.js";
import { Documented } from "./documented.js";
import { faultsAt } from "./faults.js";
import { Slider } from "./slider.js";
import { isAnimated, isSame, keyframesText, numberOf, numbersOf, textOf, valueAt } from "./job_file.js";

const FEW = 4; // Up to so many choices are radio buttons.

// Names in backticks are shown as code.
export const words = (text) => text.split("`").map((part, place) => (place % 2 ? html`<code>${part}</code>` : part));

// `form` is {job, set(path, value), faults, hints}: `hints` are the values that count when the job says none, by path.
export function Simple({ field, path, form }) {
  const value = valueAt(form.job, path);
  if (isAnimated(value)) return html`<${Animated} ...${{ field, path, form, value }} />`;
  const Input = { flag: Flag, choice: Choices, set: Several, tuple: Numbers }[field.kind] || Text;
  return html`<${Input} ...${{ field, path, form, value, said: faultsAt(form.faults, path) }} />`;
}

// The explanation of a field, or in its place what is wrong with the value, so that nothing below moves; and the way to
// the documentation of the field.
/** @param {{ id: string, text?: string, said?: string[], more?: string, label?: string }} about */
export function Help({ id, text, said = [], more, label }) {
  const way = more && html` <${Documented} page=${more}>More<span class="unseen"> about ${label}</span><//>`;
  if (said.length) return html`<span class="fault" id="e-${id}">${said.join("; ")}${way}</span>`;
  return text ? html`<span class="help" id="h-${id}">${words(text)}${way}</span>` : null;
}

const unitOf = ({ unit }) => unit && html` <span class="quiet">${unit}</span>`;
const described = (path, { help }, said) => (said.length ? `e-${path}` : help ? `h-${path}` : null);
const hintOf = (field, path, form) => valueAt(form.hints, path) ?? field.fallback;

// While somebody writes, the input shows what is written; otherwise the value.
function Input({ id, value, hint, isNumeric, put, ...rest }) {
  const [draft, setDraft] = useState(null);
  const write = (event) => {
    setDraft(event.target.value);
    put(event.target.value);
  };
  return html`
    <input id="f-${id}" name=${id} autocomplete="off" spellcheck=${false} inputmode=${isNumeric ? "decimal" : null}
      value=${draft ?? textOf(value ?? hint)} placeholder=${textOf(hint) || null} onInput=${write}
      onBlur=${() => setDraft(null)} ...${rest} />
  `;
}

function Text({ field, path, form, value, said }) {
  const isNumeric = field.kind === "number";
  const read = { number: numberOf, values: field.isNumber ? numbersOf : textsOf }[field.kind] || plainText;
  const shown = value ?? hintOf(field, path, form);
  const list = field.examples?.length && field.kind === "text" ? `l-${path}` : null;
  return html`
    <div class="field ${isNumeric ? "" : "wide"}">
      <label for="f-${path}">${field.label}${unitOf(field)}</label>
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
  const input = (item, place) => html`
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

// A number with keyframes: they are written in the job file.
function Animated({ field, path, form, value }) {
  const said = faultsAt(form.faults, path);
  return html`
    <div class="field wide">
      <span class="label">${field.label}${unitOf(field)}</span>
      <p class="keyframes">${keyframesText(value)}
        <button type="button" onClick=${() => form.set(path, value.keyframes[0]?.[1])}>Make constant</button>
      </p>
      <${Help} id=${path} text="It changes with the frame; the job file below has its keyframes." said=${said} />
    </div>
  `;
}
