// The parameters of the chosen scene: a slider for a number with a range, a colour for a colour.
import { html } from "../../shared/html.js";
import { pageOf } from "../form/documentation.js";
import { faultsAt } from "../form/faults.js";
import { Help } from "../form/help.js";
import { Simple } from "../form/inputs.js";
import { textOf, valueAt } from "../job_file.js";
import { parameterTitle } from "../form/schema.js";

export function Parameters({ scene, form }) {
  const names = Object.keys(scene.parameters);
  if (!names.length) return null;
  return html`
    <fieldset class="parts-of-scene wide">
      <legend>Parameters of the scene</legend>
      ${names.map(
        (name) => html`
        <${Parameter} key=${`${scene.name}-${name}`} name=${name} about=${scene.parameters[name]} form=${form} />
      `,
      )}
    </fieldset>
  `;
}

function Parameter({ name, about, form }) {
  const path = `parameters.${name}`;
  const value = valueAt(form.job, path);
  const label = parameterTitle(name, about.unit);
  const field = {
    name,
    label,
    unit: about.unit,
    help: about.description,
    fallback: about.default,
    more: pageOf("parameters"),
  };
  const isNumber = about.type === "number" || about.type === "integer";
  if (about.type === "boolean") return html`<${Simple} field=${{ ...field, kind: "flag" }} ...${{ path, form }} />`;
  if (about.type === "color") return html`<${Colour} ...${{ field, path, form, value }} />`;
  const hasRange = isNumber && about.minimum !== null && about.maximum !== null;
  const range = { least: about.minimum, most: about.maximum, isInteger: about.type === "integer" };
  const kind = isNumber ? "number" : "text";
  return html`<${Simple} field=${{ ...field, kind, slider: hasRange && range }} ...${{ path, form }} />`;
}

function Colour({ field, path, form, value }) {
  const said = faultsAt(form.faults, path);
  const shown = textOf(value ?? field.fallback);
  return html`
    <div class="field">
      <label for="f-${path}">${field.label}</label>
      <span class="colour">
        <input type="color" id="f-${path}" value=${shown} aria-describedby=${`h-${path}`}
          onInput=${(event) => form.set(path, event.target.value)} />
        <output>${shown}</output>
      </span>
      <${Help} ...${{ id: path, text: field.help, said, more: field.more, label: field.label }} />
    </div>
  `;
}
