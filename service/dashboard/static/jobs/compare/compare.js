// Two jobs side by side: the same frame from the same place of the eye, and what differs. Both are painted by the
// graphics card; without it they are single views.
import { useEffect, useState } from "preact/hooks";
import { getFrameStatuses } from "../../api/operations.js";
import { Choice } from "../../shared/choice.js";
import { bytes, count, duration, jobName, quantity, secondsBetween } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { Badge } from "../../shared/parts.js";
import { loadJob } from "../../state/live.js";
import { useKnown } from "../../state/store.js";
import { scaleOf } from "../../viewer/depth/depth_scale.js";
import { MODES } from "../../viewer/modes/index.js";
import { roundedPlace } from "../../viewer/stand.js";
import { useStand } from "../../viewer/use_stand.js";
import { FIT } from "../../viewer/hand/zoom.js";
import { EyeView } from "./eye_view.js";
import { Stage, useSharedEye } from "./pair.js";
import { shortId } from "../list/row.js";
import { commonFrames, differences } from "./spec_diff.js";

const TITLES = [
  ["look", "Look"],
  ["focus", "Focus"],
];

export const Compare = ({ ids }) => html`<${Two} key=${ids.join()} ids=${ids} />`;

function Two({ ids }) {
  const jobs = useKnown((known) => known.jobs);
  const kept = useStand(ids[0]); // the id of the address
  const { change } = kept;
  // The other modes are for one job.
  const mode = kept.stand.mode === "focus" ? "focus" : "look";
  const stand = { ...kept.stand, mode, eyes: "one", showsDepth: false };
  const shared = useSharedEye(stand.place);
  const [isPainted, setPainted] = useState(true);
  const [views, setViews] = useState([]); // of each side
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
  const at = frames.includes(stand.frame) ? frames.indexOf(stand.frame) : frames.length - 1;
  const place = stand.place ?? { x: 0, y: 0 };
  const move = (to) => change({ place: roundedPlace(to) });
  const tell = (side, found) => setViews((before) => Object.assign([...before], { [side]: found }));
  const given = { frame: frames[at], stand, change, shared, tell, lose: () => setPainted(false) };
  const choose = (chosen) => change({ mode: chosen, zoom: FIT });
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
            ${jobs[id] && html`<${Facts} job=${jobs[id]} />`}
            ${jobs[id] && isPainted && html`<${Stage} ...${given} job=${jobs[id]} side=${side} />`}
            ${
              jobs[id] &&
              !isPainted &&
              html`<${EyeView} job=${jobs[id]} frame=${frames[at]} place=${place} move=${move} />`
            }
          </section>
        `,
        )}
      </div>
      ${
        frames.length > 0 &&
        html`<div class="together" role="group" aria-label="Both pictures">
          <label>Frame ${frames[at]}
            <input type="range" min="0" max=${frames.length - 1} value=${at}
              onInput=${(event) => change({ frame: frames[Number(event.target.value)] })} />
          </label>
          ${isPainted && html`<${Choice} name="Mode" choices=${TITLES} chosen=${mode} choose=${choose} />`}
          ${!(isPainted && mode === "focus") && [axis("x", "Eye across"), axis("y", "Eye down")]}
          ${
            isPainted &&
            mode === "focus" &&
            views[0] &&
            html`<${Depth} views=${views[0]} stand=${stand} change=${change} />`
          }
          ${stand.zoom.scale !== 1 && html`<button onClick=${() => change({ zoom: FIT })}>Fit</button>`}
        </div>`
      }
      <p id="pair-hint" class="unseen">${MODES[mode].hint} Both pictures follow.</p>
      ${!isPainted && html`<p class="quiet" role="status">Without WebGL2 the pictures are single views.</p>`}
      ${known && !frames.length && html`<p class="quiet">No frame is done in both jobs yet.</p>`}
      ${known && html`<${Differences} two=${two} />`}
    </article>
  `;
}

function Depth({ views, stand, change }) {
  const { depth_mm } = MODES.focus.filled(views, stand);
  const { least_mm, most_mm, step_mm } = scaleOf(views, depth_mm);
  return html`
    <label>Sharp at ${quantity(depth_mm)} mm
      <input type="range" min=${least_mm} max=${most_mm} step=${step_mm} value=${depth_mm}
        onInput=${(event) => change({ depth_mm: event.target.valueAsNumber })} />
    </label>
  `;
}

function Facts({ job }) {
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
