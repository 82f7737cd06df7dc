// The tasks that seem to be stuck, and the jobs that wait by engine and reason.
import { count } from "../shared/format.js";
import { html } from "../shared/html.js";
import { mayChange, useKnown } from "../state/store.js";
import { engineName, taskPlace } from "./words.js";

export function Stuck({ tasks, act }) {
  const stuck = tasks.filter((task) => task.stuck);
  if (!stuck.length) return null;
  return html`
    <section class="stuck" aria-labelledby="stuck-title">
      <h2 id="stuck-title">Tasks that seem to be stuck <span class="quiet">${count(stuck.length)}</span></h2>
      <ul>${stuck.map((task) => html`<${StuckTask} key=${task.id} task=${task} act=${act} />`)}</ul>
    </section>
  `;
}

function StuckTask({ task, act }) {
  const may = useKnown((known) => mayChange(known, task), [task.owner_id]);
  const what = `${taskPlace(task)} of ${task.job_title}`;
  return html`
    <li>
      <p>
        <a href="#/jobs/${task.job_id}">${task.job_title}</a> ${taskPlace(task)}
        ${task.worker && html` <span class="quiet">on ${task.worker}</span>`}
      </p>
      <p class="quiet">${task.stuck.message}</p>
      ${
        may &&
        html`
        <p class="actions">
          <button aria-label=${`Run ${what} again`} onClick=${() => act(task, "restart")}>Run again</button>
          ${
            task.status === "running" &&
            html`
            <button aria-label=${`End ${what}`} onClick=${() => act(task, "end")}>End</button>
          `
          }
        </p>
      `
      }
    </li>
  `;
}

export function Waiting({ work }) {
  return html`
    <section aria-labelledby="waiting-title">
      <h2 id="waiting-title">Jobs that wait</h2>
      ${!work.waiting.length && html`<p class="quiet">No job waits.</p>`}
      ${
        work.waiting.length > 0 &&
        html`
        <div class="table" role="region" aria-label="Table of the jobs that wait" tabindex="0"><table>
          <thead><tr>
            <th scope="col">Reason</th><th scope="col">Engine</th>
            <th scope="col" class="number">Jobs</th><th scope="col" class="number">Tasks ready</th>
            <th scope="col">First jobs</th>
          </tr></thead>
          <tbody>
            ${work.waiting.map(
              (item) => html`
              <tr key=${item.engine + item.code}>
                <td>
                  <strong>${item.code.replaceAll("-", " ")}</strong><br /><span class="quiet">${item.message}</span>
                </td>
                <td>${engineName(item.engine)}</td>
                <td class="number">${count(item.jobs)}</td>
                <td class="number">${count(item.ready_tasks)}</td>
                <td>${item.first.slice(0, 3).map((id) => html`<${JobLink} key=${id} id=${id} />`)}</td>
              </tr>
            `,
            )}
          </tbody>
        </table></div>
      `
      }
      ${work.more && html`<p class="quiet">Only the first 500 jobs and tasks are counted here.</p>`}
    </section>
  `;
}

function JobLink({ id }) {
  const job = useKnown((known) => known.jobs[id], [id]);
  return html`<a href="#/jobs/${id}">${job ? job.title || job.scene : id}</a> `;
}
