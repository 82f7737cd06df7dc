// The job file: to copy, to download, and to run again with changes.
import { useState } from "preact/hooks";
import { link } from "../api/operations.js";
import { html } from "../shared/html.js";
import { maySubmit, useKnown } from "../state/store.js";

export function JobFile({ job }) {
  const [said, say] = useState("");
  const canSubmit = useKnown(maySubmit);
  const text = () => `${JSON.stringify(job.spec, null, 2)}\n`;
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text()); // Without an encrypted connection there is no clipboard.
      say("Copied.");
    } catch {
      say("The browser does not allow it; download the file instead.");
    }
  };
  const download = () => {
    const url = URL.createObjectURL(new Blob([text()], { type: "application/json" }));
    const anchor = Object.assign(document.createElement("a"), { href: url, download: `${job.id}.json` });
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };
  return html`
    <h3>Job file</h3>
    <p class="downloads">
      <button onClick=${copy}>Copy</button>
      <button onClick=${download}>↓ Download</button>
      ${canSubmit && html`<a class="button" href="#/new?from=${job.id}">Run again changed</a>`}
      <a href=${link(`/api/v1/jobs/${job.id}`)} target="_blank">The job as JSON</a>
    </p>
    <p class="quiet" role="status">${said}</p>
  `;
}
