// The outputs of a job: a player for videos, and links to download all of them.
import { useEffect, useState } from "preact/hooks";
import { getSidecar, link } from "../api/operations.js";
import { count, many } from "../shared/format.js";
import { html } from "../shared/html.js";

const PLAYED = /\.(mp4|webm)$/;
const TITLES = {
  views: "All views",
  centre: "Centre view",
  orthoscopic: "Integral video",
  integral: "As captured",
  sweep: "Moving viewpoint",
  focus: "Focus sweep",
  stereo: "Stereo, side by side",
  anaglyph: "Anaglyph, red-cyan",
  observer: "Observer",
};
const ENDED = ["failed", "cancelled"];
const MOST_LINKS = 8;
const MOST_LOADED = 4; // A browser has six connections to a service, and other requests need some.

export function Videos({ job }) {
  if (!job.outputs.length) return null;
  // The service lists outputs in the order in which the job asked for them.
  const outputs = job.outputs.map((output, place) => ({
    ...output,
    url: link(output.url),
    archive: output.archive_url && link(output.archive_url),
    kind: job.spec.outputs[place].kind,
  }));
  const ready = outputs.filter((output) => output.ready);
  const open = outputs.length - ready.length;
  const word = ENDED.includes(job.status) ? "not made" : "to come";
  return html`
    <section class="videos" aria-label="Outputs">
      <h2>Outputs</h2>
      <div class="players">
        ${ready.filter(({ name }) => PLAYED.test(name)).map((output, place) => player(output, job, place))}
      </div>
      <p class="downloads">
        ${ready
          .filter(isVideo)
          .map(({ name, url }) => html`<a key=${name} class="button" href=${url} download>↓ ${name}</a>`)}
        ${open > 0 && html`<span class="quiet">${count(open)} ${word}</span>`}
      </p>
      ${ready.filter((output) => !isVideo(output)).map((output) => html`<${Files} key=${output.name} ...${output} />`)}
    </section>
  `;
}

const isVideo = ({ url }) => url.includes("/artifacts/video/");

const title = ({ kind, name }) => {
  const said = TITLES[kind] || kind;
  return name === `${kind}.mp4` ? said : `${said}: ${name}`;
};

// The room of a video before its size is known; two pictures may be side by side.
const ratioOf = ({ kind }, { size }) => String(((kind === "stereo" ? 2 : 1) * size.cols) / size.rows);

// The key is the name, so that a video keeps playing when the page is redrawn.
const player = (output, job, place) => html`
  <figure key=${output.name}>
    <video controls loop muted playsinline preload=${place < MOST_LOADED ? "metadata" : "none"} src=${output.url}
      poster=${job.poster && link(job.poster)} aria-label=${title(output)}
      style=${{ aspectRatio: ratioOf(output, job) }}></video>
    <figcaption>${title(output)}</figcaption>
  </figure>
`;

// The sidecar of an output of several files lists them.
function Files({ name, url, archive }) {
  const [files, setFiles] = useState([]);
  useEffect(() => {
    getSidecar(url).then(
      (told) => setFiles(told.files),
      () => setFiles([]),
    );
  }, [url]);
  const below = url.slice(0, url.indexOf("/artifacts/") + "/artifacts/".length);
  return html`
    <p class="downloads" role="group" aria-label=${name}>
      <a href=${url} download>${name}</a>
      ${archive && html`<a class="button" href=${archive} download>↓ All files (.zip)</a>`}
      ${files.length > MOST_LINKS && html`<span class="quiet">${many(files.length, "file")}</span>`}
      ${
        files.length <= MOST_LINKS &&
        files.map((file) => {
          const last = file.slice(file.lastIndexOf("/") + 1);
          return html`<a key=${file} class="button" href=${below + file} download=${last}>↓ ${last}</a>`;
        })
      }
    </p>
  `;
}
