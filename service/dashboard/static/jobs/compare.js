// Two jobs side by side: the same frame from the same place of the eye, and what differs.
import { useEffect, useState } from "preact/hooks";
import { getFrameStatuses } from "../api/operations.js";
import { write } from "../shared/address.js";
import { bytes, count, duration, jobName, secondsBetween } from "../shared/format.js";
import { html } from "../shared/html.js";
import { Badge } from "../shared/parts.js";
import { useAddress } from "../shared/use_address.js";
import { loadJob } from "../state/live.js";
import { useKnown } from "../state/store.js";
import { EyeView } from "./eye_view.js";
import { shortId } from "./row.js";
import { commonFrames, differences } from "./spec_diff.js";

export function Compare({ ids }) {
  const jobs = useKnown((known) => known.jobs);
  const query = useAddress().query;
  const [faults, setFaults] = useState({});
  const [known, setKnown] = useState(null); // the frames that both jobs have; null until they are loaded
  const two = ids.map((id) => jobs[id]);
  const isLoaded = two.every(Boolean);
  const done = two.map((job) => job?.frames_done).join();
  useEffect(() => {
    document.title = "Two jobs – Lippmann";
    for (const id of ids) loadJob(id).catch((error) => setFaults((before) => ({ ...before, [id]: error.message })));
  }, [ids.join(), isLoaded]);
  useEffect(() => {
    if (!isLoaded) return;
    const show = ([one, other]) => setKnown(commonFrames(one.runs, other.runs));
    Promise.all(ids.map(getFrameStatuses)).then(show, () => setKnown([]));
  }, [ids.join(), isLoaded, done]);
  const frames = known ?? [];
  const asked = Number(query.get("frame"));
  const at = frames.includes(asked) ? frames.indexOf(asked) : frames.length - 1;
  const place = { x: number(query.get("x")), y: number(query.get("y")) };
  const move = ({ x, y }) => write({ x: x.toFixed(3), y: y.toFixed(3) });
  const axis = (name, title) => html`
    <label>${title}
      <input type="range" min="-1" max="1" step="0.05" value=${place[name]}
        onInput=${(event) => move({ ...place, [name]: Number(event.target.value) })} />
    </label>
  `;
  return html`
    <article class="compare">
      <h1>Two jobs side by side</h1>
      <div class="sides">
        ${ids.map(
          (id, side) => html`
          <section key=${id} aria-label=${side ? "Second job" : "First job"}>
            ${faults[id] && !jobs[id] && html`<p class="fault" role="alert">${faults[id]}</p>`}
            ${jobs[id] && html`<${Side} job=${jobs[id]} frame=${frames[at]} place=${place} move=${move} />`}
          </section>
        `,
        )}
      </div>
      ${
        frames.length > 0 &&
        html`<div class="together" role="group" aria-label="Both pictures">
          <label>Frame ${frames[at]}
            <input type="range" min="0" max=${frames.length - 1} value=${at}
              onInput=${(event) => write({ frame: frames[Number(event.target.value)] })} />
          </label>
          ${axis("x", "Eye across")} ${axis("y", "Eye down")}
        </div>`
      }
      ${known && !frames.length && html`<p class="quiet">No frame is done in both jobs yet.</p>`}
      ${known && html`<${Differences} two=${two} />`}
    </article>
  `;
}

const number = (text) => Math.min(1, Math.max(-1, Number(text) || 0));

function Side({ job, frame, place, move }) {
  const took_s = job.started_at && job.ended_at && secondsBetween(job.started_at, job.ended_at);
  const facts = [
    `${count(job.frames_done)} / ${count(job.frames_total)} frames`,
    took_s && `took ${duration(took_s)}`,
    `${duration(job.cpu_s)} CPU`,
    bytes(job.artifact_bytes),
    `by ${job.owner}`,
  ];
  return html`
    <h2><a href="#/jobs/${job.id}">${jobName(job)} <code>${shortId(job.id)}</code></a></h2>
    <p class="numbers facts">
      <${Badge} status=${job.status} />
      ${facts.filter(Boolean).map((fact) => html`<span key=${fact}>${fact}</span>`)}
    </p>
    <${EyeView} job=${job} frame=${frame} place=${place} move=${move} />
  `;
}

function Differences({ two }) {
  const found = differences(two[0].spec, two[1].spec);
  if (!found.length) return html`<p class="quiet">The job files are the same.</p>`;
  return html`
    <section aria-label="Differences">
      <h2>Differences of the job files <span class="quiet">${count(found.length)}</span></h2>
      <div class="wide" tabindex="0" role="region" aria-label="Table of differences">
        <table class="tasks">
          <thead><tr><th>Field</th>${two.map((job) => html`<th>${jobName(job)} ${shortId(job.id)}</th>`)}</tr></thead>
          <tbody>
            ${found.map(
              ({ path, values }) => html`
              <tr key=${path}>
                <th scope="row"><code>${path}</code></th>
                ${values.map((value, side) => html`<td key=${side}>${value}</td>`)}
              </tr>
            `,
            )}
          </tbody>
        </table>
      </div>
    </section>
  `;
}
