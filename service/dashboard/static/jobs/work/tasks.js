// All tasks of a job, in pages.
import { useEffect, useState } from "preact/hooks";
import { getTasks } from "../../api/operations.js";
import { count } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { TaskTable } from "./task_table.js";

const ROWS = 25;
const RENEW_MS = 5000;
const STATUSES = ["running", "dispatched", "ready", "waiting", "done", "failed", "cancelled", "skipped"];
const KINDS = ["probe", "render", "assemble", "encode"];

export function Tasks({ job }) {
  const [isOpen, setOpen] = useState(false);
  const total = Object.values(job.tasks).reduce((sum, number) => sum + number, 0);
  return html`
    <section>
      <details onToggle=${(event) => setOpen(event.target.open)}>
        <summary>All tasks <span class="quiet">${count(total)}</span></summary>
        ${isOpen && html`<${Pages} job=${job} />`}
      </details>
    </section>
  `;
}

function Pages({ job }) {
  const [filter, setFilter] = useState({ status: "", kind: "" });
  const [cursors, setCursors] = useState([undefined]); // of the pages up to the one that is shown
  const [page, setPage] = useState({ items: [], next_cursor: null });
  const [fault, setFault] = useState("");
  const isOver = Boolean(job.ended_at);
  const question = JSON.stringify([job.id, filter, cursors.at(-1)]);
  useEffect(() => {
    let isOld = false;
    const query = {
      status: filter.status || undefined,
      kind: filter.kind || undefined,
      cursor: cursors.at(-1),
      limit: ROWS,
    };
    const show = (found) => isOld || (setPage(found), setFault(""));
    const load = () => getTasks(job.id, query).then(show, (error) => isOld || setFault(error.message));
    load();
    const timer = isOver ? null : setInterval(load, RENEW_MS);
    return () => {
      isOld = true;
      clearInterval(timer);
    };
  }, [question, isOver]);
  const choose = (patch) => (setFilter({ ...filter, ...patch }), setCursors([undefined]));
  const select = (name, title, values) => html`
    <select aria-label=${title} value=${filter[name]} onChange=${(event) => choose({ [name]: event.target.value })}>
      <option value="">${title}: all</option>
      ${values.map((value) => html`<option key=${value} value=${value}>${value}</option>`)}
    </select>
  `;
  return html`
    <p class="downloads">${select("status", "Status of tasks", STATUSES)} ${select("kind", "Kind", KINDS)}</p>
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
    <${TaskTable} job=${job} tasks=${page.items} />
    ${!page.items.length && !fault && html`<p class="quiet">No task matches.</p>`}
    <p class="downloads">
      <button disabled=${cursors.length < 2} onClick=${() => setCursors(cursors.slice(0, -1))}>Previous</button>
      <button disabled=${!page.next_cursor} onClick=${() => setCursors([...cursors, page.next_cursor])}>Next</button>
      <span class="quiet">page ${cursors.length}</span>
    </p>
  `;
}
