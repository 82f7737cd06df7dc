// The parameters of the chosen scene. An empty field keeps the default of the scene.
import { html } from "../shared/html.js";
import { Field, numberOr } from "./field.js";

export const fieldsOf = (names) => Object.fromEntries(names.map((name) => [`p-${name}`, `parameters.${name}`]));

// Converts the texts of inputs to the types of the parameters.
export function valuesOf(scene, texts) {
  const valueOf = (name, text) => (["number", "integer"].includes(scene.parameters[name].type) ? numberOr(text) : text);
  return Object.fromEntries(Object.entries(texts).map(([name, text]) => [name, valueOf(name, text)]));
}

export function Parameters({ scene, values, set, faults }) {
  const names = Object.keys(scene.parameters);
  if (!names.length) return null;
  const isFaulty = names.some((name) => faults[`p-${name}`]);
  const put = (name, value) => {
    const { [name]: _, ...others } = values;
    set(value === "" ? others : { ...others, [name]: value });
  };
  return html`
    <details class="parameters" open=${isFaulty || null}>
      <summary>Parameters of the scene</summary>
      ${names.map(
        (name) => html`
        <${Parameter} key=${`${scene.name}-${name}`} name=${name} about=${scene.parameters[name]} value=${values[name]}
          put=${(value) => put(name, value)} faults=${faults[`p-${name}`]} />
      `,
      )}
    </details>
  `;
}

function Parameter({ name, about, value, put, faults }) {
  const label = name.replaceAll("_", " ");
  if (about.type === "boolean") {
    return html`
      <p class="field wide">
        <label>
          <input type="checkbox" checked=${value ?? about.default} onChange=${(event) => put(event.target.checked)} />
          ${` ${label}`}
        </label>
        <span class="quiet">${about.description}</span>
      </p>
    `;
  }
  const isText = about.type === "color";
  return html`
    <div class="parameter">
      <${Field} name=${`p-${name}`} label=${label} unit=${about.unit} hint=${String(about.default)} faults=${faults}
        value=${value ?? ""} onInput=${(event) => put(event.target.value)} inputmode=${isText ? "text" : "decimal"} />
      <p class="quiet">${about.description}</p>
    </div>
  `;
}
