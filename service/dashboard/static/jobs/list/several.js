// What can be done with several jobs at once.
import { useState } from "preact/hooks";
import { patchJob, removeJob, sendAction } from "../../api/operations.js";
import { Confirm } from "../../shared/confirm.js";
import { bytes, count, jobName, many } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { dropJob, fetchJob, useKnown } from "../../state/store.js";

const AT_ONCE = 4; // requests
const SHOWN = 3; // failures
const LABELS = { pause: "Pause", resume: "Resume", cancel: "Cancel", retry: "Retry", remove: "Remove" };
const ASKED = ["cancel", "remove"];

export function Several({ picked, setPicked }) {
  const known = useKnown((state) => state.jobs);
  const [work, setWork] = useState(null); // {done, of, faults: [text]} of the last action
  const [asked, setAsked] = useState("");
  const [priority, setPriority] = useState("50");
  const jobs = [...picked.values()].map((job) => known[job.id] ?? job);
  const allowing = (action) => jobs.filter((job) => job.actions.includes(action));
  const isBusy = work !== null && work.done < work.of;
  const run = async (action, send) => {
    const left = allowing(action);
    const state = { done: 0, of: left.length, faults: [] };
    const gone = [];
    setWork({ ...state });
    const one = async () => {
      for (let job = left.shift(); job; job = left.shift()) {
        await send(job).then(
          () => action === "remove" && (dropJob(job.id), gone.push(job.id)),
          (error) => state.faults.push(`${jobName(job)}: ${error.message}`),
        );
        state.done += 1;
        setWork({ ...state });
      }
    };
    await Promise.all(Array.from({ length: AT_ONCE }, one));
    if (gone.length) setPicked(new Map([...picked].filter(([id]) => !gone.includes(id))));
  };
  const act = (action) =>
    run(action, (job) => (action === "remove" ? removeJob(job.id) : fetchJob(() => sendAction(job.id, action))));
  const prioritise = (event) => {
    event.preventDefault();
    run("prioritise", (job) => fetchJob(() => patchJob(job.id, { priority: Number(priority) })));
  };
  const some = (number) => number > 0 && number < jobs.length;
  const button = (action) => html`
    <button key=${action} disabled=${isBusy || !allowing(action).length}
      onClick=${() => (ASKED.includes(action) ? setAsked(action) : act(action))}>
      ${LABELS[action]} ${some(allowing(action).length) && count(allowing(action).length)}
    </button>
  `;
  return html`
    <div class="several" role="group" aria-label="Selected jobs">
      <strong>${many(jobs.length, "job")} selected</strong>
      <button class="plain" onClick=${() => setPicked(new Map())}>Clear selection</button>
      <p>
        ${Object.keys(LABELS).map(button)}
        ${jobs.length === 2 && html`<a class="button" href="#/compare/${jobs[0].id}/${jobs[1].id}">Compare</a>`}
      </p>
      <form onSubmit=${prioritise}>
        <label>Priority <input type="number" min="0" max="100" required value=${priority}
          onInput=${(event) => setPriority(event.target.value)} /></label>
        <button disabled=${isBusy || !allowing("prioritise").length}>Set</button>
      </form>
      <p role="status">${work && `${work.done} of ${many(work.of, "job")} done.`}</p>
      ${work?.faults.length > 0 && html`<${Faults} faults=${work.faults} />`}
      ${
        asked &&
        html`<${Question} action=${asked} jobs=${allowing(asked)}
        answer=${(isYes) => (setAsked(""), isYes && act(asked))} />`
      }
    </div>
  `;
}

const Faults = ({ faults }) => html`
  <ul class="fault" role="alert">
    ${faults.slice(0, SHOWN).map((text) => html`<li key=${text}>${text}</li>`)}
    ${faults.length > SHOWN && html`<li>${many(faults.length - SHOWN, "job")} more failed.</li>`}
  </ul>
`;

function Question({ action, jobs, answer }) {
  const what = many(jobs.length, "job");
  if (action === "cancel") {
    return html`
      <${Confirm} title="Cancel ${what}?" yes="Cancel the jobs" no="Keep the jobs" answer=${answer}>
        <p>Running tasks are stopped. Finished frames stay, and a retry continues from there.</p>
      <//>
    `;
  }
  const frames = jobs.reduce((sum, job) => sum + job.frames_done, 0);
  const size = jobs.reduce((sum, job) => sum + job.artifact_bytes, 0);
  return html`
    <${Confirm} title="Remove ${what}?" yes="Remove the jobs" no="Keep the jobs" answer=${answer}>
      <p>
        ${many(frames, "finished frame")}, the outputs and the logs of these jobs go, ${bytes(size)} in all. Nothing
        brings them back.
      </p>
    <//>
  `;
}
