// The interactive view of a frame: look around in its views, refocus it, or see it as an observer does.
import { useEffect, useRef, useState } from "preact/hooks";
import { useRequest } from "../api/request.js";
import { getFrameViews, getPicture, link, pictureUrl } from "../api/operations.js";
import { RemotePicture } from "./remote.js";
import { Footer } from "./footer.js";
import { html } from "../shared/html.js";
import { around, refocus, seen } from "./modes.js";
import { MAX_ATLAS_PX } from "./webgl.js";
import { ViewCanvas } from "./canvas.js";
import { isWhole } from "./views.js";

const LOOKS = { around, refocus, seen };
// The largest atlas that is loaded as PNG and refocused in the browser; a larger one is loaded as lossy WebP.
const EXACT_PX = 2048 ** 2;

export function Viewer({ job, frame, mode, stand, change, keys, foot }) {
  const [canPaint, setCanPaint] = useState(true);
  const found = useRequest(`${job} ${frame}`, (signal) => getFrameViews(job, frame, MAX_ATLAS_PX, signal));
  const frameViews = found.value;
  const isExact = frameViews && isWhole(frameViews) && frameViews.atlas.rows * frameViews.atlas.cols <= EXACT_PX;
  const isPainted = canPaint && (mode === "around" || (mode === "refocus" && isExact !== false));
  const atlas = useAtlas(frameViews, isPainted, isExact);
  const at = useRef(null);
  const marker = useRef(null);
  const kind = LOOKS[mode];
  const given = frameViews && { frameViews, stand: kind.filled(frameViews, stand), change, isPainted };
  const url = given && pictureUrl(job, frame, ...kind.query(given));
  const label = `Frame ${frame}, ${kind.name}`;
  const isSwaying = isPainted && mode === "around" && stand.isSwaying;

  const onPlace = (place) => {
    at.current = place;
    marker.current?.setAttribute("cx", 50 + 42 * place.x);
    marker.current?.setAttribute("cy", 50 + 42 * place.y);
  };
  // The present state, also during the sway.
  const current = () => {
    const place = (isSwaying && at.current) || given.stand.place;
    return { ...given, stand: { ...given.stand, place } };
  };
  const move = (patch) => change({ ...patch, isSwaying: mode === "around" ? false : stand.isSwaying });
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const step = (direction) => () => given && move(kind.stepped(current(), direction));
  keys.current = Object.fromEntries(Object.entries(arrows).map(([key, direction]) => [key, step(direction)]));

  const drag = useDrag((event) => {
    const side_px = Math.min(event.currentTarget.clientWidth, event.currentTarget.clientHeight);
    const from = given && kind.dragged && current();
    return from && ((across_px, down_px) => move(kind.dragged(from, across_px / side_px, down_px / side_px)));
  });
  const fault = found.fault || (isPainted && atlas.fault);
  return html`
    <div class="stage looking ${mode}" tabindex="0" role="application" aria-label=${label} aria-describedby="look-hint"
      ...${drag}>
      ${
        isPainted
          ? html`
            <${ViewCanvas} atlas=${atlas.value} label=${label} place=${given?.stand.place} isSwaying=${isSwaying}
              isWaiting=${found.isWaiting || atlas.isWaiting} onPlace=${onPlace} onLost=${() => setCanPaint(false)}
              paint=${(painter, place) => kind.paint(painter, place, given.stand)} />
          `
          : url && html`<${RemotePicture} url=${url} label=${label} isSmooth=${stand.isSmooth || mode === "seen"} />`
      }
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${mode === "around" && frameViews && html`<${Place} place=${given.stand.place} marker=${marker} />`}
    </div>
    <p id="look-hint" class="unseen">${kind.hint}</p>
    <div class="bar controls">
      ${given && html`<${kind.Controls} ...${given} pause=${() => move({ place: current().stand.place })} />`}
    </div>
    <${Footer} ...${foot} said=${given && !isSwaying ? kind.said(given) : ""}>
      ${url && html`<a href=${url} download>PNG</a>`}
    <//>
  `;
}

// Loads the atlas of a frame as {frameViews, bitmap}. The bitmap that it replaces is closed at once, since it may be
// large.
function useAtlas(frameViews, isWanted, isExact) {
  const url = frameViews && isWanted ? `${link(frameViews.atlas.url)}&format=${isExact ? "png" : "webp"}` : null;
  const atlas = useRequest(url, async (signal) => ({ frameViews, bitmap: await getPicture(url, signal) }));
  useEffect(() => () => atlas.value?.bitmap.close(), [atlas.value]);
  return atlas;
}

// `grab(event)` returns a function that is called with every movement (across, down) in px, or null.
function useDrag(grab) {
  const held = useRef(null);
  const release = () => (held.current = null);
  return {
    onPointerDown: (event) => {
      const pull = event.button === 0 && grab(event);
      if (!pull) return;
      held.current = { pull, x: event.clientX, y: event.clientY };
      event.currentTarget.setPointerCapture(event.pointerId);
    },
    onPointerMove: (event) => held.current?.pull(event.clientX - held.current.x, event.clientY - held.current.y),
    onPointerUp: release,
    onPointerCancel: release,
  };
}

// The position of the eye among the views.
function Place({ place, marker }) {
  return html`
    <svg class="place" viewBox="0 0 100 100" aria-hidden="true">
      <rect x="1" y="1" width="98" height="98" rx="8" />
      <circle ref=${marker} r="7" cx=${50 + 42 * place.x} cy=${50 + 42 * place.y} />
    </svg>
  `;
}
