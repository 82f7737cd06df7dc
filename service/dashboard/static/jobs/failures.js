// The failed tasks of a job, each with its log.
import { useEffect, useState } from "preact/hooks";
import { getTasks, link } from "../api/operations.js";
import { count, many } from "../shared/format.js";
import { html } from "../shared/html.js";

const SHOWN = 20;
const ROW_PX = 36; // A row has at least this height, so that what follows stays where it is.

export function Failures({ job }) {
  const failed = job.tasks.failed;
  const [page, setPage] = useState({ items: [], next_cursor: null });
  const [fault, setFault] = useState("");
  useEffect(() => {
    if (!failed) return;
    const show = (found) => (setPage(found), setFault(""));
    getTasks(job.id, { status: "failed", limit: SHOWN }).then(show, (error) => setFault(error.message));
  }, [job.id, failed]);
  if (!failed) return null;
  return html`
    <section class="failures" aria-label="Failed tasks">
      <h2>Failed tasks <span class="quiet">${count(failed)}</span></h2>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      <ul style=${{ minHeight: `${ROW_PX * Math.min(SHOWN, failed)}px` }}>
        ${page.items.map((task) => html`<${Row} key=${task.id} task=${task} said=${job.error?.message} />`)}
      </ul>
      ${page.next_cursor && html`<p class="quiet">The first ${count(page.items.length)} are shown.</p>`}
    </section>
  `;
}

// A message that is shown for the whole job is not repeated.
const Row = ({ task, said }) => html`
  <li>
    <span class="name">${place(task)}</span>
    <span class="quiet">${many(task.attempt_number, "attempt")}${task.worker && `, last on ${task.worker}`}</span>
    ${task.log_url && html`<a href=${link(task.log_url)} target="_blank">Log</a>`}
    ${task.error && task.error.message !== said && html`<pre tabindex="0">${task.error.message}</pre>`}
  </li>
`;

export function place({ kind, frame, tile, output }) {
  return [kind, frame !== null && `frame ${frame}`, tile && `tile ${tile.row}-${tile.col}`, output]
    .filter(Boolean)
    .join(" · ");
}
