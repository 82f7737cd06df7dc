// What the job was asked for: videos that a browser plays, and all outputs to take home.
import { useEffect, useState } from "preact/hooks";
import { getSidecar } from "./api.js";
import { count, many } from "./format.js";
import { html } from "./html.js";

const PLAYED = /\.(mp4|webm)$/;
const TITLES = {
  views: "From view to view",
  centre: "Centre view",
  orthoscopic: "Integral video",
  integral: "As it was captured",
  sweep: "An eye that swings",
  focus: "Focus through depth",
  stereo: "For two eyes, side by side",
  anaglyph: "For red-cyan glasses",
  observer: "What an eye sees",
};
const ENDED = ["failed", "cancelled"];
const MOST_LINKS = 8;

export function Videos({ job }) {
  if (!job.outputs.length) return null;
  // The service lists outputs in the order in which the job asked for them.
  const outputs = job.outputs.map((output, place) => ({ ...output, kind: job.spec.outputs[place].kind }));
  const ready = outputs.filter((output) => output.ready);
  const open = outputs.length - ready.length;
  const word = ENDED.includes(job.status) ? "not made" : "to come";
  return html`
    <section class="videos" aria-label="Outputs">
      <h2>Outputs</h2>
      <div class="players">${ready.filter(({ name }) => PLAYED.test(name)).map(player)}</div>
      <p class="downloads">
        ${ready.filter(isVideo).map(
          ({ name, url }) => html`<a key=${name} class="button" href=${url} download>↓ ${name}</a>`,
        )}
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

// Keyed by name, so that a video plays on while the page draws again.
const player = (output) => html`
  <figure key=${output.name}>
    <video controls loop muted playsinline preload="metadata" src=${output.url} aria-label=${title(output)}></video>
    <figcaption>${title(output)}</figcaption>
  </figure>
`;

// An output of many files is known by what is told beside it, which lists them.
function Files({ name, url }) {
  const [files, setFiles] = useState([]);
  useEffect(() => {
    getSidecar(url).then((told) => setFiles(told.files), () => setFiles([]));
  }, [url]);
  const below = url.slice(0, url.indexOf("/artifacts/") + "/artifacts/".length);
  return html`
    <p class="downloads" role="group" aria-label=${name}>
      <a href=${url} download>${name}</a>
      ${files.length > MOST_LINKS && html`<span class="quiet">${many(files.length, "file")}</span>`}
      ${files.length <= MOST_LINKS &&
      files.map((file) => {
        const last = file.slice(file.lastIndexOf("/") + 1);
        return html`<a key=${file} class="button" href=${below + file} download=${last}>↓ ${last}</a>`;
      })}
    </p>
  `;
}
