// A row of the list of jobs.
import { link } from "../../api/operations.js";
import { count, duration, jobName } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Ago, Badge, Bar } from "../../shared/parts.js";
import { waitOf, waitWords } from "../waits.js";

// Jobs of one title are told apart by the end of their ids, which is random.
export const shortId = (id) => id.slice(-5);

export function Row({ job, href, isOpen, tick }) {
  return html`
    ${
      tick &&
      html`<input type="checkbox" checked=${tick.isOn} onClick=${tick.turn}
        aria-label="Select ${jobName(job)} ${shortId(job.id)}" />`
    }
    <a class="row" href=${href} aria-current=${isOpen ? "true" : null}>
      <${Picture} job=${job} />
      <span class="name">
        <span dir="auto" title=${jobName(job)}>${jobName(job)}</span>${" "}
        <code title=${job.id}>${shortId(job.id)}</code>
      </span>
      <${Badge} status=${job.status} />
      <${Bar} job=${job} />
      <span class="numbers">${count(job.frames_done)} / ${count(job.frames_total)} frames</span>
      <span class="numbers end">${lastWords(job)}</span>
      <span class="numbers" title="Owner">${job.owner}</span>
      <span class="numbers end" title="CPU time so far">${duration(job.cpu_s)} CPU</span>
    </a>
  `;
}

const Picture = ({ job }) =>
  job.poster
    ? html`<img class="poster" src=${link(job.poster)} alt="" width="48" height="48" decoding="async" />`
    : html`<span class="poster lattice" aria-hidden="true"></span>`;

function lastWords(job) {
  if (job.status === "running" && job.eta_s !== null) return `${duration(job.eta_s)} left`;
  const words = waitWords(job);
  if (words) return html`<span title=${waitOf(job).message}>${words}</span>`;
  return html`<${Ago} time=${job.created_at} />`;
}
