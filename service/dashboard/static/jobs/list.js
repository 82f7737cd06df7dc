// The list of jobs, newest first.
import { useState } from "preact/hooks";
import { ago, count, duration, exactTime, jobName, percent } from "../shared/format.js";
import { html } from "../shared/html.js";
import { loadMoreJobs } from "../state/live.js";
import { newestFirst, useKnown } from "../state/store.js";
import { waitOf, waitWords } from "./waits.js";

export function JobList({ open }) {
  const jobs = useKnown((known) => known.jobs);
  const cursor = useKnown((known) => known.jobsCursor);
  const isLoaded = useKnown((known) => known.jobsLoaded);
  const shown = newestFirst(jobs);
  return html`
    <nav class="jobs" aria-label="Jobs">
      <h2>Jobs</h2>
      ${isLoaded && !shown.length && html`<p class="quiet">No jobs yet. <a href="#/new">Submit the first one.</a></p>`}
      <ol>
        ${shown.map((job) => html`<${Row} key=${job.id} job=${job} isOpen=${job.id === open} />`)}
      </ol>
      ${cursor && html`<${More} what="more jobs" load=${loadMoreJobs} />`}
    </nav>
  `;
}

function Row({ job, isOpen }) {
  return html`
    <li>
      <a class="row" href="#/jobs/${job.id}" aria-current=${isOpen ? "true" : null}>
        <span class="name">${jobName(job)}</span>
        <${Badge} status=${job.status} />
        <${Bar} job=${job} />
        <span class="numbers">${count(job.frames_done)} / ${count(job.frames_total)} frames</span>
        <span class="numbers end">${lastWords(job)}</span>
      </a>
    </li>
  `;
}

function lastWords(job) {
  if (job.status === "running" && job.eta_s !== null) return `${duration(job.eta_s)} left`;
  const words = waitWords(job);
  if (words) return html`<span title=${waitOf(job).message}>${words}</span>`;
  return html`<${Ago} time=${job.created_at} />`;
}

export function Ago({ time }) {
  const now_ms = useKnown((known) => known.now_ms);
  return html`<time datetime=${time} title=${exactTime(time)}>${ago(time, now_ms)}</time>`;
}

export const Badge = ({ status }) => html`<span class="badge ${status}">${status}</span>`;

export function Bar({ job }) {
  const label = `${jobName(job)}: ${percent(job.progress)} done`;
  return html`<progress class=${job.status} max="1" value=${job.progress} aria-label=${label}></progress>`;
}

// A button that loads the next page, once at a time, and shows the error if that fails.
export function More({ what, load }) {
  const [state, setState] = useState("ready");
  const go = async () => {
    setState("loading");
    try {
      await load();
      setState("ready");
    } catch (error) {
      setState(error.message);
    }
  };
  return html`
    <p class="more">
      <button onClick=${go} disabled=${state === "loading"}>Show ${what}</button>
      ${!["ready", "loading"].includes(state) && html`<span class="fault" role="alert">${state}</span>`}
    </p>
  `;
}
