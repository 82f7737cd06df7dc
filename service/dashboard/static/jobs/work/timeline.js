// The timeline of attempts by worker.
import { useEffect, useState } from "preact/hooks";
import { nowMs } from "../../api/clock.js";
import { getAttempts } from "../../api/operations.js";
import { count, duration, exactTime } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { place } from "../failures.js";
import { layOut, outcomesOf, ticksOf } from "./timeline_layout.js";

const RENEW_MS = 3000;
const MOST = 500;
const TICKS = 6;
const SLOT_PX = 14;

export function Timeline({ job }) {
  const [isOpen, setOpen] = useState(false);
  if (!job.started_at) return null;
  return html`
    <section>
      <details onToggle=${(event) => setOpen(event.target.open)}>
        <summary>Attempts by worker</summary>
        ${isOpen && html`<${Lanes} job=${job} />`}
      </details>
    </section>
  `;
}

function Lanes({ job }) {
  const [list, setList] = useState(null);
  const [fault, setFault] = useState("");
  const isOver = Boolean(job.ended_at);
  useEffect(() => {
    const show = (found) => (setList({ ...found, now_s: nowMs() / 1000 }), setFault(""));
    const load = () => getAttempts(job.id, MOST).then(show, (error) => setFault(error.message));
    load();
    const timer = isOver ? null : setInterval(load, RENEW_MS);
    return () => clearInterval(timer);
  }, [job.id, isOver]);
  if (fault) return html`<p class="fault" role="alert">${fault}</p>`;
  if (!list) return html`<p class="quiet">Loading …</p>`;
  const { workers, start_s, end_s } = layOut(list.items, list.now_s);
  const length_s = Math.max(0.001, end_s - start_s);
  const part = (at_s) => `${(100 * (at_s - start_s)) / length_s}%`;
  const shown = count(list.items.length);
  const isPart = list.total > list.items.length;
  const wide = (time_s) => `${Math.max(0.15, (100 * time_s) / length_s)}%`;
  return html`
    <div class="timeline">
      ${workers.map(
        ({ name, slots }) => html`
        <div key=${name} class="lane">
          <span class="name">${name}</span>
          <svg height=${slots.length * SLOT_PX} role="img"
            aria-label="${name}: ${count(slots.flat().length)} attempts in ${slots.length} slots">
            ${slots.map((bars, slot) => bars.map((bar) => rectangle({ bar, slot, part, wide })))}
          </svg>
        </div>
      `,
      )}
      <p class="axis numbers">
        ${ticksOf(length_s, TICKS).map(
          (at_s) => html`<span key=${at_s} style=${{ left: part(start_s + at_s) }}>${duration(at_s)}</span>`,
        )}
      </p>
    </div>
    <p class="quiet">
      ${isPart && `The last ${shown} of ${count(list.total)} attempts, `} from ${exactTime(start_s * 1000)} on.
    </p>
    <ul class="outcomes">
      ${outcomesOf(list.items).map(
        ([outcome, number]) => html`<li key=${outcome}><i class=${outcome}></i>${outcome} ${count(number)}</li>`,
      )}
    </ul>
  `;
}

function rectangle({ bar, slot, part, wide }) {
  const why = bar.error_code && bar.outcome !== "lost" ? ` (${bar.error_code})` : "";
  const took = duration(bar.end_s - bar.start_s);
  const words = `${place(bar)}, attempt ${bar.number}: ${bar.outcome}${why}, ${took}`;
  return html`
    <rect key="${bar.task} ${bar.number}" class=${bar.outcome} x=${part(bar.start_s)} y=${slot * SLOT_PX + 1}
      width=${wide(bar.end_s - bar.start_s)} height=${SLOT_PX - 3}><title>${words}</title></rect>
  `;
}
