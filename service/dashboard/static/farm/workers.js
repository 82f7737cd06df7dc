// The workers: their state, what each renders now, and what an admin may do with it.
import { link } from "../api/operations.js";
import { percent } from "../shared/format.js";
import { html } from "../shared/html.js";
import {
  avoided,
  enginesOf,
  loadOf,
  secondsAgo,
  tasksByWorker,
  taskPlace,
  workerActions,
  workerState,
} from "./words.js";

export function Workers({ farm, isAdmin, act }) {
  const { workers, excluded, known, work, at_s } = farm;
  const tasks = tasksByWorker(work.tasks);
  const away = excluded.filter(({ worker }) => !workers.some(({ name }) => name === worker));
  return html`
    <section aria-labelledby="workers-title">
      <h2 id="workers-title">Workers</h2>
      ${
        !known &&
        html`
        <p class="fault">The broker does not answer, so no worker is known. Look at the log of the service.</p>
      `
      }
      ${known && !workers.length && html`<${NoWorkers} isAdmin=${isAdmin} />`}
      <ul class="workers">
        ${workers.map(
          (worker) => html`
          <${Worker} key=${worker.name} worker=${worker} tasks=${tasks[worker.name] || []} at_s=${at_s}
            act=${isAdmin ? act : null} />
        `,
        )}
      </ul>
      ${
        away.length > 0 &&
        html`
        <ul class="away" aria-label="Excluded workers that are not online">
          ${away.map(
            ({ worker, name }) => html`
            <li key=${worker}>
              <span class="name">${worker}</span>
              <span class="quiet">is excluded by ${name} and not online.</span>
              ${isAdmin && html`<button onClick=${() => act(worker, "include", "Include")}>Include ${worker}</button>`}
            </li>
          `,
          )}
        </ul>
      `
      }
    </section>
  `;
}

const NoWorkers = ({ isAdmin }) => html`
  <div class="empty">
    <p>No worker is online, so nothing is rendered. Start one on this machine:</p>
    <p><code>lippmann worker</code></p>
    <p class="quiet">
      ${
        isAdmin
          ? html`For another machine, make a join file with${" "}
            <code>lippmann keys create HOST --worker --out HOST.toml</code>, and start${" "}
            <code>lippmann worker --join HOST.toml</code> there.`
          : "For another machine, ask an admin for a join file."
      }
    </p>
  </div>
`;

function Worker({ worker, tasks, at_s, act }) {
  const { word, tone, why } = workerState(worker);
  const id = `worker-${worker.name}`;
  return html`
    <li aria-labelledby=${id}>
      <header>
        <h3 id=${id}>${worker.name}</h3>
        <span class="badge ${tone}">${word}</span>
        <span class="numbers">${worker.running} of ${worker.slots} slots</span>
        ${
          act &&
          html`
          <p class="actions">
            ${workerActions(worker).map(
              ([action, title, explanation]) => html`
              <button key=${action} title=${explanation} aria-label=${`${title} ${worker.name}`}
                onClick=${() => act(worker.name, action, title)}>${title}</button>
            `,
            )}
          </p>
        `
        }
      </header>
      ${why && html`<p class="why">${why}</p>`}
      ${
        worker.avoided_by > 0 &&
        html`
        <p class="why">${avoided(worker.avoided_by)}, because tasks failed there.</p>
      `
      }
      <ul class="tasks" aria-label=${`Tasks of ${worker.name}`}>
        ${tasks.map((task) => html`<${Task} key=${task.id} task=${task} />`)}
      </ul>
      <dl class="traits">
        <${Trait} name="Host" value=${worker.host} />
        <${Trait} name="Heard" value=${secondsAgo(worker.seen_s, at_s)} />
        <${Trait} name="Load" value=${loadOf(worker)} />
        <${Trait} name="Sandbox" value=${worker.sandbox} />
        <${Trait} name="Engines" value=${enginesOf(worker)} />
        <${Trait} name="Version" value=${worker.version} title=${worker.version_note} />
        ${worker.pool && html`<${Trait} name="Pool" value=${worker.pool} />`}
        ${worker.tags.length > 0 && html`<${Trait} name="Tags" value=${worker.tags.join(", ")} />`}
      </dl>
    </li>
  `;
}

const Trait = ({ name, value, title }) => html`
  <div title=${title || null}><dt>${name}</dt><dd>${value}</dd></div>
`;

const Task = ({ task }) => html`
  <li>
    ${
      task.picture
        ? html`<img src=${link(task.picture)} alt="" width="44" height="44" loading="lazy" />`
        : html`<span class="lattice" aria-hidden="true"></span>`
    }
    <a href="#/jobs/${task.job_id}">${task.job_title}</a>
    <span class="quiet">${taskPlace(task)}${task.progress === null ? "" : `, ${percent(task.progress)}`}</span>
    <progress max="1" value=${task.progress ?? 0} aria-label=${`${task.job_title}, ${taskPlace(task)}`}></progress>
  </li>
`;
