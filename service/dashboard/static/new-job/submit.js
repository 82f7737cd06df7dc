// The form for a new job: its fields come from the schema of the job file that the service serves.
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { getJob, getScenes, getSchema, link, postJob } from "../api/operations.js";
import { html } from "../shared/html.js";
import { useAddress } from "../shared/use_address.js";
import { change, fetchJob, getState, maySubmit, useKnown } from "../state/store.js";
import { useCheck } from "./check.js";
import { DesignPanel } from "./design.js";
import { forgetDraft, keepDraft, keptDraft } from "./draft.js";
import { faultsAt, hasFault, otherFaults } from "./form/faults.js";
import { Field, More } from "./form/fields.js";
import { groupsOf } from "./form/groups.js";
import { jobFileOf, valueAt, withValue } from "./job_file.js";
import { JobText } from "./job_text.js";
import { exceededWords } from "./limits.js";
import { Parameters } from "./scenes/parameters.js";
import { Preview, usePreview } from "./preview.js";
import { Presets } from "./presets.js";
import { Scenes } from "./scenes/scenes.js";
import { fieldsOf } from "./form/schema.js";
import { Upload } from "./scenes/upload.js";

const FRAMES = "1-8"; // A short video, as a first job.

export function Submit() {
  const scenes = useKnown((known) => known.scenes);
  const [schema, setSchema] = useState(null);
  const [job, setJob] = useState(null);
  const [fresh, setFresh] = useState(null); // The job of a form that nobody has changed, if another one is shown.
  const [problem, setProblem] = useState(null);
  const from = useAddress().query.get("from"); // A job to run again with changes.
  useEffect(() => {
    document.title = "New job – Lippmann";
    setProblem(null);
    const begin = ([{ items }, found, first]) => {
      change({ scenes: items });
      setSchema(found);
      const unchanged = first ? jobFileOf(first.spec, defaultsOf(found)) : { scene: firstScene(items), frames: FRAMES };
      const kept = keptDraft(from);
      setFresh(kept ? unchanged : null);
      setJob(kept ?? unchanged);
    };
    Promise.all([getScenes(), getSchema("job"), from && getJob(from)]).then(begin, setProblem);
  }, [from]);
  const setAndKeep = (changed) => {
    keepDraft(from, changed);
    setJob(changed);
  };
  const beginAgain = () => {
    forgetDraft();
    setJob(fresh);
    setFresh(null);
  };
  return html`
    <div class="submit">
      <a class="back" href="#/">← All jobs</a>
      <h1 id="submit-title">New job</h1>
      ${problem && html`<div class="fault whole" role="alert"><p>${problem.message}</p></div>`}
      ${
        schema && job
          ? html`
            ${
              fresh &&
              html`<p>This is the form as you left it.
                ${" "}<button class="plain" onClick=${beginAgain}>Begin again</button></p>`
            }
            <${Form} ...${{ schema, scenes, job, setJob: setAndKeep }} />
          `
          : html`<p class="quiet loading">${problem ? "" : "Loading …"}</p>`
      }
    </div>
  `;
}

const firstScene = (scenes) => (scenes.find(({ poster }) => poster) || scenes[0])?.name;
const defaultsOf = (schema) =>
  Object.fromEntries(fieldsOf(schema, schema).map(({ name, fallback }) => [name, fallback]));

function Form({ schema, scenes, job, setJob }) {
  const [refusal, setRefusal] = useState(null);
  const [isBusy, setBusy] = useState(false);
  const last = useRef({ text: "", key: "" });
  const mayNot = useKnown((known) => known.session !== null && !maySubmit(known));
  const scene = scenes.find(({ name }) => name === job.scene);
  const design = useCheck(job);
  const pictures = useRef({}); // By scene.
  // A preview is asked for when the service has accepted the job.
  const isAccepted = !design.problem && !design.faults.length && design.checked === JSON.stringify(job);
  const preview = usePreview(job, !mayNot && !scene?.sheets && isAccepted);
  if (preview.preview) pictures.current[preview.preview.scene] = preview.preview.view;
  // The form is long, and the field that is wrong may be out of sight.
  useEffect(() => {
    const wrong = refusal && document.querySelector("#new-job [aria-invalid=true]");
    if (wrong instanceof HTMLElement) wrong.focus();
  }, [refusal]);
  const put = (changed) => {
    setRefusal(null);
    setJob(changed);
  };
  const faults = refusal?.fields.length ? refusal.fields : design.faults;
  const beyond = exceededWords(design.limits);
  // The values that count when the job says none: those of the scene, of the array by name, and those that follow.
  const array = schema.lens_arrays[valueAt(job, "rig.lens_array.preset")];
  const rig = { lens_array: array, px_per_lens: design.numbers?.px_per_lens };
  const hints = { title: job.scene, stage: scene?.stage, clock: scene?.clock, rig };
  const form = {
    job,
    faults,
    hints,
    animation: schema.animation,
    set: (path, value) => put(withValue(job, path, value)),
  };
  const choose = (name) => {
    const { parameters: _, stage: __, ...others } = job; // They belong to the previous scene.
    put({ ...others, scene: name });
  };
  const add = (made) => {
    const others = getState().scenes.filter(({ name }) => name !== made.name);
    change({ scenes: [made, ...others] });
    choose(made.name);
  };
  const submit = async (event) => {
    event.preventDefault();
    setBusy(true);
    const text = JSON.stringify(job);
    // The key makes a repeated submission idempotent if no answer arrived.
    if (last.current.text !== text) last.current = { text, key: newKey() };
    try {
      const made = await fetchJob(() => postJob(job, last.current.key));
      forgetDraft();
      location.hash = `#/jobs/${made.id}`;
    } catch (error) {
      setRefusal(error);
    }
    setBusy(false);
  };
  const groups = useMemo(() => groupsOf(schema), [schema]);
  const paths = ["scene", "parameters", ...groups.flatMap(pathsOf)];
  return html`
    <form id="new-job" onSubmit=${submit} noValidate aria-labelledby="submit-title">
      <${Presets} presets=${schema.presets} job=${job} setJob=${put} />
      <div class="fields">
        ${groups.map(
          (group) => html`
            <${Group} key=${group.name} group=${group} form=${form}>
              ${
                group.name === "scene" &&
                html`
                  <${Scenes} ...${{ scenes, choose }} pictures=${pictures.current} chosen=${job.scene}
                    said=${faultsAt(faults, "scene")}>
                    <${Upload} isAllowed=${!mayNot} add=${add} />
                  <//>
                  ${scene && html`<${Parameters} ...${{ scene, form }} />`}
                `
              }
            <//>
          `,
        )}
      </div>
      <div class="beside">
        <${Preview} ...${{ ...preview, scene, form }} isStale=${design.problem !== null} mayNot=${mayNot} />
        <${DesignPanel} ...${design} />
      </div>
      <div class="end">
        <${JobText} job=${job} setJob=${put} />
      </div>
    </form>
    <div class="send">
      ${
        refusal &&
        html`
        <div class="fault whole" role="alert">
          ${otherFaults(faults, paths).map((text) => html`<p>${text}</p>`)}
          <p>${faults.length ? "Some fields need another look." : refusal.message}</p>
        </div>
      `
      }
      <div role="status">
        ${
          beyond.length > 0 &&
          html`<div class="whole beyond"><p>The service refuses this job as it is.</p>
            ${beyond.map((text) => html`<p>${text}</p>`)}</div>`
        }
      </div>
      <p class="choices">
        <button form="new-job" class="primary" disabled=${isBusy || mayNot}>
          ${isBusy ? "Submitting …" : "Submit"}
        </button>
        <span class="quiet">${mayNot ? READS_ONLY : faults.length || beyond.length ? "" : READY}</span>
      </p>
    </div>
  `;
}

const READY = "Every field has a value already: the job can be submitted as it is.";

const READS_ONLY =
  "Your key has the role viewer, which sees jobs and submits none. An administrator can give you a key " +
  "with the role submitter.";

const pathsOf = ({ first, more }) => [...first, ...more.flatMap(({ fields }) => fields)].map(({ path }) => path);

const namesOf = ({ title, fields }) => title || fields.map(({ label }) => label).join(", ");

function Group({ group, form, children }) {
  const { title, first, more } = group;
  const rest = more.flatMap(({ fields }) => fields.map(({ path }) => path));
  const model = (first[0] || more[0].fields[0]).owner;
  const label = `${title} in the reference`;
  const drawn = (fields) =>
    fields.map((field) => html`<${Field} key=${field.path} ...${{ field, form }} path=${field.path} />`);
  return html`
    <fieldset class="group">
      <legend>${title}
        <a class="reference" href=${link(`/docs#${model}`)} target="_blank" aria-label=${label}>reference</a>
      </legend>
      ${children}${drawn(first)}
      ${
        more.length > 0 &&
        html`
        <${More} title=${`More: ${more.map(namesOf).join(", ").toLowerCase()}`} isOpen=${hasFault(form.faults, rest)}>
          ${more.map(
            (one) => html`
            ${one.title && html`<h2><a href=${link(`/docs#${one.model}`)} target="_blank">${one.title}</a></h2>`}
            <div class="parts">${drawn(one.fields)}</div>
          `,
          )}
        <//>
      `
      }
    </fieldset>
  `;
}

// A random key; crypto.randomUUID does not exist on pages over plain HTTP.
const newKey = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (word) => word.toString(36)).join("");
