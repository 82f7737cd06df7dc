// The interactive view of a frame: look around in its views, refocus it, or see it as an observer does.
import { useEffect, useRef, useState } from "preact/hooks";
import { useRequest } from "../api/request.js";
import { getFrameViews, getPicture, link, pictureUrl } from "../api/operations.js";
import { RemotePicture } from "./remote.js";
import { Footer } from "./footer.js";
import { html } from "../shared/html.js";
import { MODES } from "./modes/index.js";
import { MAX_ATLAS_PX } from "./webgl.js";
import { ViewCanvas } from "./canvas.js";
import { isWhole } from "./views.js";

// The largest atlas that is loaded as PNG and refocused in the browser; a larger one is loaded as lossy WebP.
const EXACT_PX = 2048 ** 2;
const STILL_PX = 4; // A pointer that moves less clicks.

export function Viewer({ job, frame, mode, stand, change, keys, foot }) {
  const [canPaint, setCanPaint] = useState(true);
  const found = useRequest(`${job} ${frame}`, (signal) => getFrameViews(job, frame, MAX_ATLAS_PX, signal));
  const frameViews = found.value;
  const isExact = frameViews && isWhole(frameViews) && frameViews.atlas.rows * frameViews.atlas.cols <= EXACT_PX;
  const isPainted = canPaint && (mode === "look" || (mode === "focus" && isExact !== false));
  const atlas = useAtlas(frameViews, isPainted, isExact);
  const at = useRef(null);
  const marker = useRef(null);
  const kind = MODES[mode];
  const given = frameViews && { frameViews, stand: kind.filled(frameViews, stand), change, isPainted };
  const url = given && pictureUrl(job, frame, ...kind.query(given));
  const label = `Frame ${frame}, ${kind.name}`;
  const isSwaying = isPainted && mode === "look" && stand.isSwaying;

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
  const move = (patch) => change({ ...patch, isSwaying: mode === "look" ? false : stand.isSwaying });
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const step = (direction) => () => given && move(kind.stepped(current(), direction));
  keys.current = Object.fromEntries(Object.entries(arrows).map(([key, direction]) => [key, step(direction)]));

  const drag = useDrag(
    (event) => {
      const side_px = Math.min(event.currentTarget.clientWidth, event.currentTarget.clientHeight);
      const from = given && kind.dragged && current();
      return from && ((across_px, down_px) => move(kind.dragged(from, across_px / side_px, down_px / side_px)));
    },
    (event) => {
      const picture = event.currentTarget.querySelector("canvas");
      const part = kind.clicked && given && picture && partOf(picture, event);
      if (part) Promise.resolve(kind.clicked(given, ...part)).then((patch) => patch && change(patch));
    },
  );
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
          : url &&
            html`<${RemotePicture} url=${url} label=${label} isSmooth=${stand.isSmooth || mode === "observer"} />`
      }
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${mode === "look" && frameViews && html`<${Place} place=${given.stand.place} marker=${marker} />`}
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

// The place of the pointer in a picture that is fitted into its element: (across, down), 0 to 1, or null beside it.
function partOf(canvas, { clientX, clientY }) {
  const box = canvas.getBoundingClientRect();
  const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
  const across = (clientX - box.x - box.width / 2) / (canvas.width * scale) + 0.5;
  const down = (clientY - box.y - box.height / 2) / (canvas.height * scale) + 0.5;
  return [across, down].every((part) => part >= 0 && part <= 1) ? [across, down] : null;
}

// `grab(event)` returns a function that is called with every movement (across, down) in px, or null. `click(event)` is
// called if the pointer has not moved.
function useDrag(grab, click) {
  const held = useRef(null);
  const down = useRef(null);
  const release = () => (held.current = null);
  const up = (event) => {
    release();
    const from = down.current;
    if (from && Math.hypot(event.clientX - from.x, event.clientY - from.y) < STILL_PX) click(event);
    down.current = null;
  };
  return {
    onPointerDown: (event) => {
      down.current = event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
      const pull = event.button === 0 && grab(event);
      if (!pull) return;
      held.current = { pull, x: event.clientX, y: event.clientY };
      event.currentTarget.setPointerCapture(event.pointerId);
    },
    onPointerMove: (event) => held.current?.pull(event.clientX - held.current.x, event.clientY - held.current.y),
    onPointerUp: up,
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
