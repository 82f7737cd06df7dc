// A preview of the first frame: a small integral image and the view in the middle, rendered again after every change.
import { useEffect, useRef, useState } from "preact/hooks";
import { getWorkers, postPreview } from "../api/operations.js";
import { by } from "../shared/format.js";
import { html } from "../shared/html.js";
import { valueAt } from "./job_file.js";
import { angleOf, turned } from "./turn.js";

const ASK_AGAIN_MS = 15_000; // How long it is taken as known whether a worker renders previews.
const REPLACED = 409; // A newer preview of this page was asked for.
const INVALID = 422; // The check says what is wrong.
const NOBODY = "No worker that is online renders previews.";
const NEEDS_SUBMITTER = "A preview needs a key with the role submitter.";
const BEGUN = "The first frame is rendered …";
const SERIES = `page-${Math.random().toString(36).slice(2)}`;

// One preview is rendered at a time; of the changes meanwhile, the last one is rendered next.
export function usePreview(job, isWanted) {
  const [found, setFound] = useState({ preview: null, said: "", isWaiting: false });
  const work = useRef({ isBusy: false, next: null, isGone: false });
  const question = isWanted ? JSON.stringify(job) : "";
  useEffect(() => {
    if (!question) return;
    work.current.next = job;
    renderNext(work.current, setFound);
  }, [question]);
  useEffect(() => () => void (work.current.isGone = true), []);
  return found;
}

async function renderNext(work, setFound) {
  if (work.isBusy || !work.next) return;
  const job = work.next;
  const put = (patch) => work.isGone || setFound((before) => ({ ...before, ...patch }));
  Object.assign(work, { isBusy: true, next: null });
  try {
    if (await isRendered()) {
      put({ isWaiting: true });
      const preview = await postPreview(job, SERIES);
      const [view, integral] = await Promise.all([preview.view, preview.integral].map(bitmapOf));
      put({ preview: { ...preview, view, integral }, said: "" });
    } else put({ said: NOBODY });
  } catch (error) {
    if (![REPLACED, INVALID].includes(error.status)) put({ said: error.message });
  }
  put({ isWaiting: false });
  work.isBusy = false;
  renderNext(work, setFound);
}

const known = { asked_ms: -Infinity, isSo: false };

async function isRendered() {
  if (performance.now() - known.asked_ms > ASK_AGAIN_MS) {
    const { items } = await getWorkers();
    Object.assign(known, { isSo: items.some(({ previews }) => previews), asked_ms: performance.now() });
  }
  return known.isSo;
}

async function bitmapOf({ png }) {
  const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
  return createImageBitmap(new Blob([bytes], { type: "image/png" }));
}

// The pictures have their place before they come.
// While the form has an error, they are those before it.
export function Preview({ preview, said, isWaiting, scene, form, isStale, mayNot }) {
  const text = mayNot ? NEEDS_SUBMITTER : said || (preview ? sizeOf(preview) : isWaiting ? BEGUN : "");
  return html`
    <section class="preview ${isStale ? "stale" : ""}" aria-label="Preview" aria-busy=${isWaiting}>
      <${Picture} name="View in the middle" bitmap=${preview?.view} />
      <${Picture} name="Integral image" bitmap=${preview?.integral} />
      <div class="about">
        ${scene && html`<${Turn} stage=${scene.stage} form=${form} />`}
        <p class="help" role="status">${text}</p>
      </div>
    </section>
  `;
}

const sizeOf = ({ frame, rig, total_s }) =>
  `Frame ${frame} with ${by(rig.lens_cols, rig.lens_rows)} lenses of ${rig.px_per_lens} px, in ${total_s.toFixed(1)} s`;

function Picture({ name, bitmap }) {
  return html`
    <figure>
      <div class="place">${bitmap && html`<${Shot} bitmap=${bitmap} name=${name} />`}</div>
      <figcaption>${name}</figcaption>
    </figure>
  `;
}

// A picture of a preview; without a name it is decoration.
export function Shot({ bitmap, name = "" }) {
  const canvas = useRef(null);
  useEffect(() => {
    if (!bitmap) return;
    Object.assign(canvas.current, { width: bitmap.width, height: bitmap.height });
    canvas.current.getContext("2d").drawImage(bitmap, 0, 0);
  }, [bitmap]);
  return html`<canvas ref=${canvas} role=${name ? "img" : "presentation"} aria-label=${name || null} />`;
}

// The rig on a circle about the point that it looks at.
function Turn({ stage, form }) {
  const location = valueAt(form.job, "stage.location") ?? stage.location;
  const turn = (event) => {
    const deg = Number(event.target.value);
    form.set("stage.location", deg ? turned(stage, deg) : undefined);
  };
  return html`
    <label class="turn"><span>Turn of the rig <span class="quiet">°</span></span>
      <input type="range" min="-45" max="45" step="1" value=${angleOf(stage, location)} onInput=${turn} />
    </label>
  `;
}
