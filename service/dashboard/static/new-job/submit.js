// The form for a new job: scene, frames and optics. Errors of the service appear at their fields.
import { useEffect, useRef, useState } from "preact/hooks";
import { getScenes, link, postJob } from "../api/operations.js";
import { Design } from "./design.js";
import { by, many } from "../shared/format.js";
import { Field, numberOr } from "./field.js";
import { html } from "../shared/html.js";
import { fieldsOf, Parameters, valuesOf } from "./parameters.js";
import { change, fetchJob, useKnown } from "../state/store.js";

// The defaults of the service.
const DEFAULTS = {
  title: "",
  frames: "1-8",
  fps: "8",
  lens_rows: "90",
  lens_cols: "90",
  px_per_lens: "8",
  offset_mm: "40",
  priority: "50",
};

// The field of the job file for each input, longest name first; errors of the service are assigned by it.
const FIELDS = {
  scene: "scene",
  title: "title",
  frames: "frames",
  fps: "fps",
  priority: "priority",
  lens_rows: "rig.lens_array.count.0",
  lens_cols: "rig.lens_array.count.1",
  px_per_lens: "rig.px_per_lens",
  offset_mm: "rig.lens_array.offset_mm",
};

export function Submit() {
  const scenes = useKnown((known) => known.scenes);
  const [values, setValues] = useState(DEFAULTS);
  const [sceneName, setSceneName] = useState(null);
  const [parameters, setParameters] = useState({});
  const [problem, setProblem] = useState(null);
  const [busy, setBusy] = useState(false);
  const last = useRef({ text: "", key: "" });
  useEffect(() => {
    document.title = "New job – Lippmann";
    getScenes().then(({ items }) => change({ scenes: items }), setProblem);
  }, []);
  const scene = scenes?.find(({ name }) => name === sceneName) || scenes?.find(({ poster }) => poster) || scenes?.[0];
  const set = (name) => (event) => setValues({ ...values, [name]: event.target.value });
  const choose = (name) => {
    setSceneName(name);
    setParameters({}); // They belong to the previous scene.
  };
  const said = sortOut(problem, Object.keys(scene?.parameters || {}));

  const submit = async (event) => {
    event.preventDefault();
    setBusy(true);
    setProblem(null);
    const spec = specOf(scene.name, values, valuesOf(scene, parameters));
    const text = JSON.stringify(spec);
    // The key makes a repeated submission idempotent if no answer arrived.
    if (last.current.text !== text) last.current = { text, key: newKey() };
    try {
      const job = await fetchJob(() => postJob(spec, last.current.key));
      location.hash = `#/jobs/${job.id}`;
    } catch (error) {
      setProblem(error);
    }
    setBusy(false);
  };
  const input = (name, label, more = {}) => html`
    <${Field} key=${name} name=${name} label=${label} value=${values[name]} onInput=${set(name)}
      faults=${said[name]} ...${more} />
  `;
  return html`
    <form class="submit" onSubmit=${submit} noValidate aria-labelledby="submit-title">
      <a class="back" href="#/">← All jobs</a>
      <h1 id="submit-title">New job</h1>
      ${problem && html`<div class="fault whole" role="alert">${said.whole.map((text) => html`<p>${text}</p>`)}</div>`}
      <${Scenes} scenes=${scenes} chosen=${scene} choose=${choose} faults=${said.scene} />
      <fieldset>
        <legend>Sequence</legend>
        ${input("frames", "Frames", { hint: "1-48:2, 60", wide: true })}
        ${input("fps", "Frames per second", { inputmode: "decimal" })}
      </fieldset>
      <fieldset>
        <legend>Optics</legend>
        ${input("lens_rows", "Lenses, rows", { inputmode: "numeric" })}
        ${input("lens_cols", "Lenses, columns", { inputmode: "numeric" })}
        ${input("px_per_lens", "Pixels per lens", { inputmode: "numeric" })}
        ${input("offset_mm", "Offset", { inputmode: "decimal", unit: "mm" })}
        <p class="sum numbers">${sum(values)}</p>
      </fieldset>
      <${Design} spec=${scene ? opticsOf(scene.name, values) : null} />
      ${scene && html`<${Parameters} scene=${scene} values=${parameters} set=${setParameters} faults=${said} />`}
      <fieldset>
        <legend>Job</legend>
        ${input("title", "Title", { wide: true, hint: scene?.title })}
        ${input("priority", "Priority", { inputmode: "numeric", hint: "0 to 100, higher first" })}
      </fieldset>
      <p class="choices">
        <button class="primary" disabled=${busy || !scene}>${busy ? "Submitting …" : "Submit"}</button>
      </p>
    </form>
  `;
}

function Scenes({ scenes, chosen, choose, faults }) {
  return html`
    <fieldset class="scenes">
      <legend>Scene</legend>
      ${!scenes && html`<p class="quiet">Loading …</p>`}
      ${scenes?.map(
        ({ name, title, poster }) => html`
          <label key=${name} class="scene">
            <input type="radio" name="scene" checked=${name === chosen?.name} onChange=${() => choose(name)} />
            ${poster ? html`<img src=${link(poster)} alt="" loading="lazy" />` : html`<span class="lattice"></span>`}
            <span>${title}</span>
          </label>
        `,
      )}
      ${chosen?.description && html`<p class="quiet about">${chosen.description}</p>`}
      ${faults?.map((text) => html`<p class="fault">${text}</p>`)}
    </fieldset>
  `;
}

function specOf(scene, values, parameters) {
  const { title, frames, fps, lens_rows, lens_cols, px_per_lens, offset_mm, priority } = values;
  return {
    scene,
    title,
    frames,
    fps: numberOr(fps),
    priority: numberOr(priority),
    parameters,
    rig: {
      lens_array: { count: [numberOr(lens_rows), numberOr(lens_cols)], offset_mm: numberOr(offset_mm) },
      px_per_lens: numberOr(px_per_lens),
    },
  };
}

// The part of a job that the design needs; null while a number is incomplete.
function opticsOf(scene, values) {
  const { rig } = specOf(scene, values, {});
  const [rows, cols, px] = [...rig.lens_array.count, rig.px_per_lens];
  const isWhole = [rows, cols, px - 1].every((value) => Number.isInteger(value) && value > 0);
  return isWhole && Number.isFinite(rig.lens_array.offset_mm) ? { scene, rig } : null;
}

// The errors of the service by input; the others belong to the whole form.
function sortOut(problem, parameterNames) {
  const said = { whole: [] };
  if (!problem) return said;
  const fields = Object.entries({ ...FIELDS, ...fieldsOf(parameterNames) });
  for (const { field, expected, got } of problem.fields || []) {
    const text = `expected ${expected}, got ${got}`;
    const [name] = fields.find(([, path]) => field === path || field.startsWith(`${path}.`)) || [];
    if (name) (said[name] ??= []).push(text);
    else said.whole.push(`${field}: ${text}`);
  }
  if (!said.whole.length) said.whole.push(problem.fields?.length ? "Some fields need another look." : problem.message);
  return said;
}

function sum({ lens_rows, lens_cols, px_per_lens }) {
  const [rows, cols, px] = [lens_rows, lens_cols, px_per_lens].map(Number);
  if (![rows, cols, px].every((value) => Number.isInteger(value) && value > 0)) return "";
  return `Integral image ${by(cols * px, rows * px)} px, ${many(px * px, "view")} of ${by(cols, rows)} px`;
}

// A random key; crypto.randomUUID does not exist on pages over plain HTTP.
const newKey = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (word) => word.toString(36)).join("");
