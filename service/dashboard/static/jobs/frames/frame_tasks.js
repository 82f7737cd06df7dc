// The tasks of a frame: its tiles as a picture of what is rendered, and a table.
import { useEffect, useState } from "preact/hooks";
import { getTasks } from "../../api/operations.js";
import { percent } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { TaskTable } from "../work/task_table.js";

const RENEW_MS = 2000;
const MOST = 500; // as many as a page of the API has

export function FrameTasks({ job, frame, close }) {
  const [tasks, setTasks] = useState([]);
  const [fault, setFault] = useState("");
  const isOver = Boolean(job.ended_at);
  useEffect(() => {
    const show = (page) => (setTasks(page.items), setFault(""));
    const load = () => getTasks(job.id, { frame, limit: MOST }).then(show, (error) => setFault(error.message));
    load();
    if (isOver) return undefined;
    const timer = setInterval(load, RENEW_MS);
    return () => clearInterval(timer);
  }, [job.id, frame, isOver]);
  const tiles = tasks.filter((task) => task.kind === "render" && task.tile);
  const cols = tiles.reduce((most, { tile }) => Math.max(most, tile.col + 1), 1);
  const gridTemplateColumns = `repeat(${cols}, minmax(0, 2.6rem))`;
  return html`
    <section class="of-frame" aria-label="Frame ${frame}">
      <h3>Frame ${frame} <button class="plain" onClick=${close}>Close</button></h3>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${
        tiles.length > 1 &&
        html`<ol class="tiles" aria-label="Tiles" style=${{ gridTemplateColumns }}>
          ${tiles.map((task) => html`<${Tile} key=${task.id} task=${task} />`)}
        </ol>`
      }
      <${TaskTable} job=${job} tasks=${tasks} />
    </section>
  `;
}

function Tile({ task }) {
  const words = task.status === "running" && task.progress !== null ? percent(task.progress) : task.status;
  const part = task.status === "running" ? (task.progress ?? 0) : 0;
  return html`
    <li class=${task.status} title="Tile ${task.tile.row}-${task.tile.col}: ${words}">
      <span class="part" style=${{ height: `${part * 100}%` }}></span><span class="unseen">${words}</span>
    </li>
  `;
}
