// The question before a job is removed: what goes.
import { useEffect, useState } from "preact/hooks";
import { getArtifacts } from "../api/operations.js";
import { Confirm } from "../shared/confirm.js";
import { bytes, count, many } from "../shared/format.js";
import { html } from "../shared/html.js";

const MOST_FILES = 500; // as many as a page of the API has

export function RemoveQuestion({ job, answer }) {
  const [files, setFiles] = useState("its files");
  useEffect(() => {
    const show = ({ items, next_cursor }) =>
      setFiles(next_cursor ? `more than ${count(MOST_FILES)} files` : many(items.length, "file"));
    getArtifacts(job.id, MOST_FILES).then(show, () => {});
  }, [job.id]);
  const outputs = job.outputs.filter((output) => output.ready).length;
  return html`
    <${Confirm} title="Remove this job?" yes="Remove the job" no="Keep the job" answer=${answer}>
      <p>
        ${many(job.frames_done, "finished frame")}, ${many(outputs, "output")} and the logs go: ${files},
        ${" "}${bytes(job.artifact_bytes)}. Nothing brings them back.
      </p>
    <//>
  `;
}
