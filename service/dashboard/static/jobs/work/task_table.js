// A table of tasks, and the log of one of them.
import { useState } from "preact/hooks";
import { duration, percent } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Badge } from "../../shared/parts.js";
import { place } from "../failures.js";
import { Log } from "./log.js";

export function TaskTable({ job, tasks }) {
  const [read, setRead] = useState(null); // the task whose log is open
  return html`
    <div class="wide" tabindex="0" role="region" aria-label="Table of tasks">
      <table class="tasks">
        <thead>
          <tr><th>Task</th><th>Status</th><th>Worker</th><th>Attempt</th><th>Took</th><th>CPU</th><th>Log</th></tr>
        </thead>
        <tbody>${tasks.map((task) => html`<${Line} key=${task.id} task=${task} read=${setRead} />`)}</tbody>
      </table>
    </div>
    ${read && html`<${Log} key=${read.id} job=${job} task=${read} close=${() => setRead(null)} />`}
  `;
}

function Line({ task, read }) {
  const isRunning = task.status === "running" && task.progress !== null;
  return html`
    <tr>
      <th scope="row">${place(task)}</th>
      <td title=${task.wait?.message ?? task.error?.message}>
        <${Badge} status=${task.status} /> ${isRunning && percent(task.progress)} ${task.cached && "from the cache"}
      </td>
      <td>${task.worker ?? ""}</td>
      <td>${task.attempt_number || ""}</td>
      <td>${task.wall_s === null ? "" : duration(task.wall_s)}</td>
      <td>${task.cpu_s === null ? "" : duration(task.cpu_s)}</td>
      <td>
        ${
          task.log_url &&
          html`<button class="plain" aria-label="Log of ${place(task)}" onClick=${() => read(task)}>Log</button>`
        }
      </td>
    </tr>
  `;
}
