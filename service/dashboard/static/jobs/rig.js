// The specification of a job: optics, sequence, and the notes of the check of the optics.
import { by, count, duration, quantity } from "../shared/format.js";
import { html } from "../shared/html.js";
import { JobFile } from "./job_file.js";

export function Rig({ job }) {
  const { size, spec } = job;
  const { lens_array: array, camera } = spec.rig;
  const facts = [
    ["Lenses", by(size.lens_rows, size.lens_cols)],
    ["Pixels per lens", by(size.px_per_lens, size.px_per_lens)],
    ["Integral image", `${by(size.cols, size.rows)} px`],
    ["Pitch", `${quantity(array.pitch_mm)} mm`],
    ["Focal length", `${quantity(array.focal_length_mm)} mm`],
    ["Offset", `${quantity(array.offset_mm)} mm`],
    ["Imaging lens", lensName(spec.rig.imaging_lens)],
    ["Camera", camera.projection],
    ["Scene", job.scene],
    ["Frames", job.frames.text],
    ["Rate", `${quantity(job.fps)} frames/s`],
    ["Priority", count(job.priority)],
    ["CPU time", duration(job.cpu_s)],
  ];
  const parameters = Object.entries(spec.parameters || {});
  return html`
    <aside class="rig" aria-label="Rig">
      <h2>Rig</h2>
      <dl>${facts.map(pair)}</dl>
      ${parameters.length > 0 && html`<h3>Parameters</h3><dl>${parameters.map(pair)}</dl>`}
      ${job.notes.length > 0 && html`<h3>Notes</h3>${job.notes.map((note) => html`<p class="note">${note}</p>`)}`}
      <${JobFile} job=${job} />
    </aside>
  `;
}

// The imaging lens is given by name, by name and focal length, by surfaces, or not at all.
function lensName(lens) {
  if (lens === null) return "none (direct pickup)";
  if (typeof lens === "string") return lens;
  return lens.name ? `${lens.name}, ${quantity(lens.focal_length_mm)} mm` : lens.title || "own prescription";
}

const pair = ([name, value]) => html`<div><dt>${name}</dt><dd>${String(value)}</dd></div>`;
