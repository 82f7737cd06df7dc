// Views and other focuses as the graphics card paints them, at once; the eye sways until somebody takes over.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { html } from "./html.js";
import { Painter } from "./painter.js";
import { clamp } from "./views.js";

const SWAY_S = 9; // Once there and back.
const SWAY = { x: 0.55, y: 0.2 }; // How far, of the way to the outermost views.
const SETTLE_S = 1.5; // From where the eye was left to the way that it sways.
const MAX_SIDE_PX = 2048; // Of the canvas; a browser enlarges what is larger.
const SLOW_MS = 60; // From frame to frame: so many in a row, and there is less to paint from then on.
const SLOW_FRAMES = 4;
const LEAST_DETAIL = 0.25;

// `paint(painter, place)` paints; `onPlace` hears of every place on the way, `onLost` that there is no painting here.
export function Painting({ atlas, label, place, paint, isSwaying, isWaiting, onPlace, onLost }) {
  const canvas = useRef(null);
  const painter = useRef(null);
  const now = useRef({});
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
    if (atlas) painter.current?.load(atlas.look, atlas.bitmap);
  }, [atlas]);

  // One picture for every frame of the screen, however many events came.
  const draw = useRef(null);
  draw.current ??= once((now_ms) => {
    if (!painter.current?.look) return;
    const { place: left, ...then } = now.current;
    began.current = then.isSwaying ? (began.current ?? now_ms) : null;
    const at = then.isSwaying ? swayed(left, (now_ms - began.current) / 1000) : left;
    notice(pace.current, then.isSwaying, now_ms);
    fit(canvas.current, painter.current.look, pace.current.detail);
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

// Asks for the next frame of the screen, unless that is asked for.
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

// Where a machine without a graphics card cannot keep up, the canvas gets fewer pixels.
function notice(pace, isSwaying, now_ms) {
  const isSlow = isSwaying && pace.last_ms !== null && now_ms - pace.last_ms > SLOW_MS;
  pace.slow = isSlow ? pace.slow + 1 : 0;
  pace.last_ms = isSwaying ? now_ms : null;
  if (pace.slow < SLOW_FRAMES) return;
  pace.detail = Math.max(LEAST_DETAIL, pace.detail / 1.5);
  pace.slow = 0;
}

// As many pixels as the screen has there, or a part of them, in the shape of a view.
function fit(canvas, { view_cols, view_rows }, detail) {
  const room = canvas.parentElement;
  const scale = Math.min(room.clientWidth / view_cols, room.clientHeight / view_rows) * devicePixelRatio * detail;
  const times = clamp(scale, 0, Math.max(1, MAX_SIDE_PX / Math.max(view_cols, view_rows)));
  const [width, height] = [view_cols, view_rows].map((px) => Math.max(1, Math.round(px * times)));
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}
