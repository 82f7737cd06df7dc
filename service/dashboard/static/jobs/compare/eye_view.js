// A view of a frame from a place of the eye, which the pointer moves.
import { useEffect, useState } from "preact/hooks";
import { getFrameViews, pictureUrl } from "../../api/operations.js";
import { html } from "../../shared/html.js";
import { viewAt } from "./spec_diff.js";

const VIEWS_PX = 256; // The atlas is not used, only its description.

// One picture is requested at a time, so that a quick hand does not fill a queue: the last place is shown at the end.
export function EyeView({ job, frame, place, move }) {
  const [views, setViews] = useState(null);
  const [fault, setFault] = useState("");
  const [shown, setShown] = useState("");
  const [isBusy, setBusy] = useState(false);
  useEffect(() => {
    if (frame === undefined) return undefined;
    const asked = new AbortController();
    const put = (act) => (value) => asked.signal.aborted || act(value);
    getFrameViews(job.id, frame, VIEWS_PX, asked.signal).then(
      put((found) => (setViews(found), setFault(""))),
      put((error) => setFault(error.message)),
    );
    return () => asked.abort();
  }, [job.id, frame]);
  const [u, v] = views ? viewAt(views, place) : [0, 0];
  const wanted = views && pictureUrl(job.id, views.frame, "view", { u, v, format: "webp" });
  useEffect(() => {
    if (!wanted || isBusy || wanted === shown) return;
    setBusy(true);
    setShown(wanted);
  }, [wanted, isBusy, shown]);
  const follow = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    const part = (at, from, size) => Math.min(1, Math.max(-1, (2 * (at - from)) / size - 1));
    move({ x: part(event.clientX, box.left, box.width), y: part(event.clientY, box.top, box.height) });
  };
  const ratio = views ? views.view_cols / views.view_rows : job.size.lens_cols / job.size.lens_rows;
  return html`
    <div class="eye lattice" style=${{ aspectRatio: String(ratio) }} onPointerMove=${follow}>
      ${
        shown &&
        html`<img src=${shown} alt="Frame ${views.frame}, view ${u}, ${v}" onLoad=${() => setBusy(false)}
          onError=${() => setBusy(false)} />`
      }
    </div>
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
  `;
}
