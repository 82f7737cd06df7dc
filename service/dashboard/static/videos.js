// The videos that the job was asked for: those a browser plays, and all of them to take home.
import { count } from "./format.js";
import { html } from "./html.js";

const PLAYED = /\.(mp4|webm)$/;
const TITLES = { "views.mp4": "From view to view", "centre.mp4": "Centre view" };
const ENDED = ["failed", "cancelled"];

export function Videos({ job }) {
  if (!job.outputs.length) return null;
  const ready = job.outputs.filter((output) => output.ready);
  const open = job.outputs.length - ready.length;
  const word = ENDED.includes(job.status) ? "not made" : "to come";
  return html`
    <section class="videos" aria-label="Videos">
      <h2>Videos</h2>
      <div class="players">${ready.filter(({ name }) => PLAYED.test(name)).map(player)}</div>
      <p class="downloads">
        ${ready.map(
          ({ name, url }) => html`<a key=${name} class="button" href=${url} download>↓ ${name}</a>`,
        )}
        ${open > 0 && html`<span class="quiet">${count(open)} ${word}</span>`}
      </p>
    </section>
  `;
}

// Keyed by name, so that a video plays on while the page draws again.
const player = ({ name, url }) => html`
  <figure key=${name}>
    <video controls loop muted playsinline preload="metadata" src=${url} aria-label=${TITLES[name] || name}></video>
    <figcaption>${TITLES[name] || name}</figcaption>
  </figure>
`;
