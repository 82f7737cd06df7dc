// One job: its status, its results, and its errors.
import { useEffect, useState } from "preact/hooks";
import { Actions } from "./actions.js";
import { Design } from "../new-job/design.js";
import { Failures } from "./failures.js";
import { count, duration, jobName, many, percent, secondsBetween } from "../shared/format.js";
import { Frames } from "./frames/frames.js";
import { html } from "../shared/html.js";
import { Ago, Badge, Bar } from "../shared/parts.js";
import { loadJob } from "../state/live.js";
import { Rig } from "./rig.js";
import { Looker } from "../viewer/looker.js";
import { useKnown } from "../state/store.js";
import { Videos } from "./videos.js";
import { Tasks } from "./work/tasks.js";
import { Timeline } from "./work/timeline.js";
import { Wait, WaitingTasks } from "./waits.js";

export function Job({ id }) {
  const job = useKnown((known) => known.jobs[id], [id]);
  const [fault, setFault] = useState("This job was removed.");
  useEffect(() => {
    if (!job) setFault("");
    loadJob(id).catch((error) => setFault(error.message));
  }, [id]);
  useEffect(() => {
    document.title = job ? `${jobName(job)} – Lippmann` : "Lippmann";
  }, [job && jobName(job)]);
  if (!job)
    return html`
      ${fault && html`<h1>No such job</h1>`}
      <p class=${fault ? "fault" : "quiet"} role="status">${fault || "Loading …"}</p>
      ${fault && html`<p><a href="#/">All jobs</a></p>`}
    `;
  return html`
    <article class="job">
      <a class="back" href="#/">← All jobs</a>
      <header>
        <h1 dir="auto" title=${jobName(job)}>${jobName(job)}</h1>
        <${Badge} status=${job.status} />
        <${Actions} job=${job} />
      </header>
      <${Progress} job=${job} />
      <${Wait} job=${job} />
      ${job.pause?.reason && html`<${Pause} pause=${job.pause} />`}
      ${job.error && html`<${Fault} error=${job.error} />`}
      <${Looker} job=${job} />
      <div class="work">
        <div class="made">
          <${Videos} job=${job} />
          <${Frames} job=${job} />
          <${Failures} job=${job} />
          <${WaitingTasks} job=${job} />
          <${Timeline} job=${job} />
          <${Tasks} job=${job} />
          <${Optics} job=${job} />
        </div>
        <${Rig} job=${job} />
      </div>
    </article>
  `;
}

function Progress({ job }) {
  const { tasks } = job;
  const open = tasks.waiting + tasks.ready + tasks.dispatched;
  const parts = [
    `${count(job.frames_done)} / ${many(job.frames_total, "frame")}`,
    job.status === "running" &&
      job.eta_s !== null &&
      `about ${duration(job.eta_s)} left on ${many(tasks.running, "slot")}`,
    job.started_at && job.ended_at && `took ${duration(secondsBetween(job.started_at, job.ended_at))}`,
    `${many(tasks.done, "task")} done`,
    tasks.running > 0 && `${count(tasks.running)} running`,
    open > 0 && `${count(open)} ${job.ended_at ? "not done" : "to come"}`,
    job.cache_hits > 0 && `${many(job.cache_hits, "tile")} from the cache`,
    tasks.failed > 0 && html`<b class="failed">${count(tasks.failed)} failed</b>`,
  ];
  // Screen readers announce every tenth and every change of status.
  const tenths = Math.floor(job.progress * 10);
  const [spoken, speak] = useState("");
  useEffect(() => speak(`${jobName(job)}: ${job.status}, ${tenths * 10} percent done`), [job.status, tenths]);
  return html`
    <div class="progress">
      <${Bar} job=${job} />
      <strong>${percent(job.progress)}</strong>
    </div>
    <p class="numbers facts">
      ${parts.filter(Boolean).map((part) => html`<span>${part}</span>`)}
      <span>submitted <${Ago} time=${job.created_at} /> by ${job.owner}</span>
    </p>
    <p class="unseen" aria-live="polite">${spoken}</p>
  `;
}

// The design is requested when the section is opened, not for every job.
function Optics({ job }) {
  const [isOpen, setOpen] = useState(false);
  return html`
    <section>
      <details class="optics" key=${job.id} onToggle=${(event) => setOpen(event.target.open)}>
        <summary>Optics and display</summary>
        ${isOpen && html`<${Design} spec=${job.spec} />`}
      </details>
    </section>
  `;
}

// The reason why the farm has paused the job; a user's pause has none.
const Pause = ({ pause }) => html`
  <section class="error" aria-label="Pause" role="status">
    <h2>Paused by the ${pause.by} <code>${pause.code}</code></h2>
    <p>${pause.reason} The job goes on by itself when the cause has gone. Resume tries again at once.</p>
  </section>
`;

const Fault = ({ error }) => html`
  <section class="error" aria-label="Error">
    <h2>Failed <code>${error.code}</code></h2>
    <pre tabindex="0">${error.message}</pre>
  </section>
`;
