// Fields with parts: objects that may be absent, values of several forms, and lists of objects.
import { useState } from "preact/hooks";
import { html } from "../../shared/html.js";
import { pageOfOutput } from "./documentation.js";
import { Documented } from "./documented.js";
import { faultsAt, hasFault } from "./faults.js";
import { Help, words } from "./help.js";
import { Radios, Simple } from "./inputs.js";
import { isSame, valueAt, withValue } from "../job_file.js";
import { formWith, startOf } from "./schema.js";

export function Field({ field, path, form }) {
  if (field.kind === "list") return html`<${List} ...${{ field, path, form }} />`;
  if (field.kind === "union" || field.kind === "object") return html`<${Forms} ...${{ field, path, form }} />`;
  return html`<${Simple} ...${{ field, path, form }} />`;
}

const inside = (form) => (form?.kind === "object" ? form.fields.map(({ name }) => name) : []);

// A value of one of several forms. An object that may be absent has one form, and none.
function Forms({ field, path, form }) {
  const forms = field.kind === "union" ? field.forms : [{ ...field, label: "given" }];
  const value = valueAt(form.job, path);
  const counts = value === undefined ? field.fallback : value;
  const current =
    formWith(forms, counts) || (counts === null ? undefined : forms.find(({ kind }) => kind === "object"));
  const children = inside(current).map((name) => `${path}.${name}`);
  const hasInput = current && !["object", "choice"].includes(current.kind);
  const said = faultsAt(form.faults, path, hasInput ? [path] : children);
  // A default other than null must be replaced by null; without one, nothing says the same.
  const none = field.fallback === null ? undefined : null;
  const options = [
    ...(field.isOptional ? [[undefined, "none"]] : []),
    ...forms.map((one) => [one, one.kind === "choice" ? one.choices.join(" or ") : one.label]),
  ];
  const put = (one) => form.set(path, one ? (formWith([one], field.fallback) ? undefined : startOf(one)) : none);
  return html`
    <div class="forms wide">
      <${Radios} ...${{ field, path, said, options, put }} isChosen=${(one) => one?.label === current?.label} />
      ${
        hasInput &&
        html`<${Simple} field=${{ ...current, label: labelOf(field, current), fallback: field.fallback }}
        ...${{ path, form }} />`
      }
      ${current?.kind === "object" && html`<${Parts} fields=${current.fields} ...${{ path, form }} />`}
    </div>
  `;
}

const labelOf = (field, { kind }) => (kind === "text" ? "Name" : field.label);

export function Parts({ fields, path, form }) {
  return html`
    <div class="parts">
      ${fields.map(
        (field) => html`
        <${Field} key=${field.name} field=${field} path="${path}.${field.name}" form=${form} />
      `,
      )}
    </div>
  `;
}

// A list of objects, as the outputs of a job: each with its options, and one more of any form.
function List({ field, path, form }) {
  const items = valueAt(form.job, path) ?? (field.fallback ?? []).map((item) => briefly(field.forms, item));
  const [tag, setTag] = useState(field.forms[0].tag);
  const own = faultsAt(
    form.faults,
    path,
    items.map((_, place) => `${path}.${place}`),
  );
  const set = (changed) => form.set(path, changed);
  const add = () => set([...items, startOf(field.forms.find((one) => one.tag === tag))]);
  const chosen = field.forms.find((one) => one.tag === tag);
  // A change of one item of a list that the job does not have yet begins with the default list.
  const job = withValue(form.job, path, items);
  const changing = { ...form, job, set: (inner, value) => set(valueAt(withValue(job, inner, value), path)) };
  return html`
    <div class="list wide" role="group" aria-label=${field.label}>
      <${Help} id=${path} said=${own} />
      ${items.map(
        (item, place) => html`
        <${Item} key=${`${place}-${item.kind || item}`} ...${{ field, item, place, form: changing }}
          path="${path}.${place}"
          remove=${() => set(items.filter((_, other) => other !== place))} />
      `,
      )}
      <div class="add">
        ${
          field.forms.length > 1 &&
          html`
          <label><span class="quiet">${`One more of the ${field.label.toLowerCase()}`}</span>
            <select onChange=${(event) => setTag(event.target.value)}>
              ${field.forms.map(
                (one) => html`<option value=${one.tag} selected=${one.tag === tag}>${one.label}</option>`,
              )}
            </select>
          </label>
        `
        }
        <button type="button" onClick=${add}>Add</button>
        ${chosen?.tag && html`<p class="help">${words(chosen.help)}</p>`}
      </div>
    </div>
  `;
}

// An item without the options that are the default.
function briefly(forms, item) {
  const fields = formWith(forms, item)?.fields || [];
  const own = fields.filter(({ name, fallback }) => item[name] !== undefined && !isSame(item[name], fallback));
  return item.kind ? { kind: item.kind, ...Object.fromEntries(own.map(({ name }) => [name, item[name]])) } : item;
}

function Item({ field, item, place, path, form, remove }) {
  const one =
    formWith(field.forms, item) || (typeof item === "object" && field.forms.length === 1 ? field.forms[0] : null);
  const title = one?.label || String(item?.kind ?? item);
  const children = one ? one.fields.map(({ name }) => `${path}.${name}`) : [];
  return html`
    <div class="item" role="group" aria-label=${`${title}, ${place + 1}`}>
      <p class="head"><strong>${title}</strong>
        <button type="button" class="plain" aria-label=${`Remove ${title}, ${place + 1}`} onClick=${remove}>
          Remove
        </button>
      </p>
      ${
        one?.tag &&
        html`<p class="help">${words(one.help)}${" "}
          <${Documented} page=${pageOfOutput(one.tag)}>More<span class="unseen"> about ${title}</span><//></p>`
      }
      <${Help} id=${path} said=${faultsAt(form.faults, path, children)} />
      ${
        one &&
        html`
        <${More} title="Options" isOpen=${!one.tag || hasFault(form.faults, [path])}>
          <${Parts} fields=${one.fields} path=${path} form=${form} />
        <//>
      `
      }
      ${!one && html`<p class="help">Its options are in the job file below.</p>`}
    </div>
  `;
}

// What is below "More" is drawn when it is opened, and stays open while it has an error.
export function More({ title, isOpen, children }) {
  const [wanted, setWanted] = useState(false);
  const open = wanted || isOpen;
  return html`
    <details class="more-fields" open=${open} onToggle=${(event) => setWanted(event.target.open)}>
      <summary>${title}</summary>
      ${open && children}
    </details>
  `;
}
