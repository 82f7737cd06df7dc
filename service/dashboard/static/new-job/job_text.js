// The job of the form as a job file: shown at any time, and read back while somebody writes in it.
import { useState } from "preact/hooks";
import { html } from "../shared/html.js";
import { jobOfJson, jsonOf } from "./job_file.js";

const ROWS = 16;

export function JobText({ job, setJob }) {
  const [draft, setDraft] = useState(null);
  const [copied, setCopied] = useState("");
  const text = draft ?? jsonOf(job);
  const { fault } = draft === null ? {} : jobOfJson(draft);
  const write = (event) => {
    setDraft(event.target.value);
    const read = jobOfJson(event.target.value);
    if (read.job) setJob(read.job);
  };
  const copy = () =>
    navigator.clipboard.writeText(text).then(
      () => setCopied("Copied."),
      () => setCopied("The browser does not allow it."),
    );
  return html`
    <details class="job-text">
      <summary>Job file</summary>
      <p class="help">The same job as JSON, for the command and the API. Changes here change the form.</p>
      <textarea aria-label="Job file as JSON" rows=${ROWS} spellcheck=${false} value=${text} onInput=${write}
        aria-invalid=${fault ? "true" : null} aria-describedby=${fault ? "e-job-text" : null}
        onBlur=${() => fault || setDraft(null)} />
      ${fault && html`<p class="fault" id="e-job-text" role="status">${fault}</p>`}
      <p class="choices">
        <button type="button" onClick=${copy} disabled=${!navigator.clipboard}>Copy</button>
        <button type="button" onClick=${() => download(text, `${job.scene || "job"}.json`)}>Download</button>
        <span role="status" class="quiet">${copied}</span>
      </p>
    </details>
  `;
}

function download(text, name) {
  const url = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  Object.assign(document.createElement("a"), { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}
