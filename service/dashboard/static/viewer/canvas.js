// Draws views and refocused pictures by the graphics card; the eye sways until the user moves it.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { html } from "../shared/html.js";
import { Painter } from "./webgl.js";
import { clamp } from "./views.js";

const SWAY_S = 9; // The period of the sway.
const SWAY = { x: 0.55, y: 0.2 }; // The amplitude, as a part of the way to the outermost views.
const SETTLE_S = 1.5; // The time from the last position of the eye to the path of the sway.
const MAX_SIDE_PX = 2048; // The longest side of the canvas; the browser enlarges it beyond that.
const SLOW_MS = 60; // The time per frame above which the canvas gets fewer pixels.
const SLOW_FRAMES = 4;
const LEAST_DETAIL = 0.25;

// `paint(painter, place)` draws; `onPlace` is called with every position, `onLost` if WebGL2 is not available.
export function ViewCanvas({ atlas, label, place, paint, isSwaying, isWaiting, onPlace, onLost }) {
  const canvas = useRef(null);
  const painter = useRef(null);
  const now = useRef(null);
  const began = useRef(null);
  const pace = useRef({ detail: 1, slow: 0, last_ms: null });
  now.current = { place, paint, isSwaying, onPlace, onLost };

  useLayoutEffect(() => {
    const lost = (event) => (event.preventDefault(), now.current.onLost());
    const node = canvas.current;
    node.addEventListener("webglcontextlost", lost);
    try {
      painter.current = new Painter(node);
    } catch {
      now.current.onLost();
    }
    return () => {
      node.removeEventListener("webglcontextlost", lost);
      painter.current?.close();
      painter.current = null;
    };
  }, []);
  useLayoutEffect(() => {
    if (atlas) painter.current?.load(atlas.frameViews, atlas.bitmap);
  }, [atlas]);

  // Draw once per screen frame, whatever the number of events.
  const draw = useRef(null);
  draw.current ??= once((now_ms) => {
    if (!painter.current?.frameViews) return;
    const { place: left, ...then } = now.current;
    began.current = then.isSwaying ? (began.current ?? now_ms) : null;
    const at = then.isSwaying ? swayed(left, (now_ms - began.current) / 1000) : left;
    notice(pace.current, then.isSwaying, now_ms);
    fit(canvas.current, painter.current.frameViews, pace.current.detail);
    then.paint(painter.current, at);
    then.onPlace?.(at);
    if (then.isSwaying) draw.current();
  });
  useLayoutEffect(() => draw.current());
  useEffect(() => {
    const resized = new ResizeObserver(() => draw.current());
    resized.observe(canvas.current.parentElement);
    return () => resized.disconnect();
  }, []);
  return html`
    <canvas ref=${canvas} role="img" aria-label=${label} aria-busy=${isWaiting || !atlas}
      class="${isWaiting ? "loading" : ""} ${atlas ? "" : "empty"}"></canvas>
  `;
}

// Requests the next screen frame, unless it is already requested.
function once(paint) {
  let isAsked = false;
  return () => {
    if (isAsked) return;
    isAsked = true;
    requestAnimationFrame((now_ms) => {
      isAsked = false;
      paint(now_ms);
    });
  };
}

function swayed(left, seconds) {
  const turn = (2 * Math.PI * seconds) / SWAY_S;
  const share = clamp(seconds / SETTLE_S, 0, 1);
  const mix = (from, to) => from + (to - from) * share * share * (3 - 2 * share);
  return { x: mix(left.x, SWAY.x * Math.sin(turn)), y: mix(left.y, SWAY.y * Math.sin(2 * turn)) };
}

// On a machine without a fast graphics card, the canvas gets fewer pixels.
function notice(pace, isSwaying, now_ms) {
  const isSlow = isSwaying && pace.last_ms !== null && now_ms - pace.last_ms > SLOW_MS;
  pace.slow = isSlow ? pace.slow + 1 : 0;
  pace.last_ms = isSwaying ? now_ms : null;
  if (pace.slow < SLOW_FRAMES) return;
  pace.detail = Math.max(LEAST_DETAIL, pace.detail / 1.5);
  pace.slow = 0;
}

// The number of screen pixels, or a part of them, with the aspect ratio of a view.
function fit(canvas, { view_cols, view_rows }, detail) {
  const room = canvas.parentElement;
  const scale = Math.min(room.clientWidth / view_cols, room.clientHeight / view_rows) * devicePixelRatio * detail;
  const times = clamp(scale, 0, Math.max(1, MAX_SIDE_PX / Math.max(view_cols, view_rows)));
  const [width, height] = [view_cols, view_rows].map((px) => Math.max(1, Math.round(px * times)));
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}
