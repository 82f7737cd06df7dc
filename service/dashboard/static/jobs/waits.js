// Why jobs and tasks wait.
import { useEffect, useState } from "preact/hooks";
import { getTasks } from "../api/operations.js";
import { place } from "./failures.js";
import { count, jobName } from "../shared/format.js";
import { html } from "../shared/html.js";
import { useKnown } from "../state/store.js";

const STATUSES = ["dispatched", "ready", "waiting"];
const SHOWN = 5; // of each status
const RENEW_MS = 5000;

// The reason of a job, unless it has begun to work since the service was asked.
export const waitOf = (job) => (!job.ended_at && (!job.tasks.running || job.status === "paused") ? job.wait : null);

// The reason in a few words, for the list of jobs; a job that starts in a moment has none.
export function waitWords(job) {
  const wait = ["queued", "probing", "running"].includes(job.status) && waitOf(job);
  return wait && wait.code !== "starting" ? wait.code.replaceAll("-", " ") : "";
}

export function Wait({ job }) {
  if (job.ended_at || job.pause?.reason) return null;
  const wait = waitOf(job) ?? { message: workOf(job), jobs: [] };
  return html`
    <p class="wait" aria-live="polite">
      ${wait.message} ${wait.jobs.map((id) => html`<${JobLink} key=${id} id=${id} />`)}
    </p>
  `;
}

// What happens in a job that does not wait; the line is always there, so that what follows stays where it is.
function workOf({ status, tasks }) {
  if (status === "probing") return "The first frame is rendered small: the scene is read, and the cost is estimated.";
  if (!tasks.running) return "The next tasks start in a moment.";
  return tasks.running === 1 ? "One task runs now." : `${count(tasks.running)} tasks run now.`;
}

function JobLink({ id }) {
  const job = useKnown((known) => known.jobs[id], [id]);
  return html`<a href="#/jobs/${id}">${job ? jobName(job) : id}</a> `;
}

// The first tasks of each status that wait; they are requested when the section is opened.
export function WaitingTasks({ job }) {
  const [isOpen, setOpen] = useState(false);
  const { waiting, ready, dispatched } = job.tasks;
  if (job.ended_at || !(waiting + ready + dispatched)) return null;
  return html`
    <section>
      <details key=${job.id} onToggle=${(event) => setOpen(event.target.open)}>
        <summary>Tasks that wait</summary>
        ${isOpen && html`<${Tasks} id=${job.id} />`}
      </details>
    </section>
  `;
}

function Tasks({ id }) {
  const [tasks, setTasks] = useState(null);
  const [fault, setFault] = useState("");
  useEffect(() => {
    const load = async () => {
      try {
        const pages = await Promise.all(STATUSES.map((status) => getTasks(id, { status, limit: SHOWN })));
        setTasks(pages.flatMap((page) => page.items));
        setFault("");
      } catch (error) {
        setFault(error.message);
      }
    };
    load();
    const timer = setInterval(load, RENEW_MS);
    return () => clearInterval(timer);
  }, [id]);
  return html`
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
    <ul class="waits" aria-label="Tasks that wait">
      ${tasks?.map(
        (task) => html`
        <li key=${task.id}>
          <span class="name">${place(task)}</span> <span class="quiet">${task.wait?.message}</span>
        </li>
      `,
      )}
    </ul>
    <p class="quiet">The first ${SHOWN} of each status are shown; <code>lippmann tasks ${id}</code> lists all.</p>
  `;
}
