// Draws views and refocused pictures by the graphics card, once per screen frame while something moves.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { html } from "../../shared/html.js";
import { Painter } from "./webgl.js";
import { rectOf } from "../hand/zoom.js";
import { clamp } from "./views.js";

const MAX_SIDE_PX = 2560; // The longest side of the canvas; the browser enlarges it beyond that.
const SLOW_MS = 45; // The time per frame above which a moving picture is drawn less exactly.
const SLOW_FRAMES = 3;
const LEAST_DETAIL = 0.35;
const REST_MS = 140; // A picture that has not moved for so long is drawn exactly.

// Whether WebGL2 draws: it does; it did, and may again; or it is not available.
export const GRAPHICS = { there: "there", lost: "lost", missing: "missing" };
export const WITHOUT_GRAPHICS = {
  lost: "The browser has lost the graphics card. The service makes the pictures until it is back.",
  missing: "Without WebGL2 the service makes the pictures.",
};

// `step(now_ms)` moves the eye and returns whether it goes on; `paint(painter)` draws; `draw` is a ref that gets the
// function which asks for another screen frame; `onGraphics` is called with a state of GRAPHICS when it changes. While
// WebGL2 is lost the canvas is hidden, and waits for the browser to restore it.
export function ViewCanvas({ atlas, guide, label, zoom, step, paint, draw, isWaiting, isRecorded, onGraphics }) {
  const canvas = useRef(null);
  const painter = useRef(null);
  const now = useRef(null);
  const pace = useRef({ cuts: 0, slow: 0, last_ms: null, rest: null });
  now.current = { step, paint, onGraphics, zoom, isRecorded };

  useLayoutEffect(() => {
    const node = canvas.current;
    let isLost = false;
    const begin = () => {
      try {
        painter.current = new Painter(node);
        if (painter.current.isSoftware) pace.current.cuts = 1;
        return GRAPHICS.there;
      } catch {
        return GRAPHICS.missing;
      }
    };
    // Without preventDefault the browser would not restore it.
    const lose = (event) => {
      event.preventDefault();
      isLost = true;
      painter.current = null;
      now.current.onGraphics(GRAPHICS.lost);
    };
    // Everything on the card is gone, so that it is made again; the atlas comes with the next properties.
    const restore = () => {
      isLost = false;
      now.current.onGraphics(begin());
    };
    node.addEventListener("webglcontextlost", lose);
    node.addEventListener("webglcontextrestored", restore);
    if (begin() === GRAPHICS.missing) now.current.onGraphics(GRAPHICS.missing);
    return () => {
      node.removeEventListener("webglcontextlost", lose);
      node.removeEventListener("webglcontextrestored", restore);
      clearTimeout(pace.current.rest);
      painter.current?.close();
      if (isLost) now.current.onGraphics(GRAPHICS.there); // The next canvas begins anew.
      painter.current = null;
    };
  }, []);
  useLayoutEffect(() => {
    if (atlas) painter.current?.load(atlas.frameViews, atlas.bitmap);
  }, [atlas]);
  useLayoutEffect(() => painter.current?.guide(atlas && guide), [atlas, guide]);

  const show = (isMoving) => {
    const { frameViews } = painter.current;
    const cuts = isMoving ? pace.current.cuts : 0;
    // A video has one size.
    if (!now.current.isRecorded) fit(canvas.current, Math.max(LEAST_DETAIL, 1.5 ** Math.min(0, 1 - cuts)));
    const picture = { width: frameViews.view_cols, height: frameViews.view_rows };
    painter.current.start({ rectIn: (part) => rectOf(now.current.zoom, picture, part), isQuick: cuts > 0 });
    now.current.paint(painter.current);
  };
  const ask = useRef(null);
  ask.current ??= once((now_ms) => {
    if (!painter.current?.frameViews) return;
    const isMoving = now.current.step(now_ms);
    notice(pace.current, isMoving, now_ms);
    clearTimeout(pace.current.rest);
    show(isMoving || pace.current.cuts > 0);
    if (isMoving) ask.current();
    else if (pace.current.cuts > 0) pace.current.rest = setTimeout(() => painter.current && show(false), REST_MS);
  });
  draw.current = ask.current;
  useLayoutEffect(() => ask.current());
  useEffect(() => {
    const resized = new ResizeObserver(() => ask.current());
    resized.observe(canvas.current.parentElement);
    return () => resized.disconnect();
  }, []);
  return html`
    <canvas
      ref=${canvas}
      role="img"
      aria-label=${label}
      aria-busy=${isWaiting}
      class="whole ${atlas ? "" : "empty"}"
    ></canvas>
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

// On a machine without a fast graphics card, a moving picture is enlarged linearly, and then has fewer pixels.
function notice(pace, isMoving, now_ms) {
  const isSlow = isMoving && pace.last_ms !== null && now_ms - pace.last_ms > SLOW_MS;
  pace.slow = isSlow ? pace.slow + 1 : 0;
  pace.last_ms = isMoving ? now_ms : null;
  if (pace.slow < SLOW_FRAMES) return;
  pace.cuts = Math.min(4, pace.cuts + 1);
  pace.slow = 0;
}

// The size of the stage in screen pixels, or a part of it.
function fit(canvas, detail) {
  const { clientWidth, clientHeight } = canvas.parentElement;
  const most = MAX_SIDE_PX / Math.max(1, clientWidth, clientHeight);
  const times = clamp(devicePixelRatio * detail, 0, most);
  const [width, height] = [clientWidth, clientHeight].map((px) => Math.max(1, Math.round(px * times)));
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}
