// All frames of a job as small squares, coloured by their status. It is one canvas, so that 10,000 of them stay smooth.
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { write } from "../../shared/address.js";
import { count } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { useAddress } from "../../shared/use_address.js";
import { closeStatuses, openStatuses } from "../../state/frame_statuses.js";
import { useKnown } from "../../state/store.js";
import { FrameTasks } from "./frame_tasks.js";
import { countsOf, placeOfFrame, STATUSES, textOf } from "./frame_runs.js";
import { gridOf, placeOf, squareAt, squareByKey } from "./grid_layout.js";

const COLOURS = ["--line", "--accent", "--good", "--bad", "--soft"]; // of STATUSES
const MOST_RANGES = 20;
const dark = matchMedia("(prefers-color-scheme: dark)");

export function FrameGrid({ job }) {
  const grid = useKnown((known) => known.grid);
  const shown = Number(useAddress().query.get("frame"));
  const [fault, setFault] = useState("");
  const [picked, setPicked] = useState(null); // the frame whose tasks are listed
  const [hover, setHover] = useState(-1);
  useEffect(() => {
    openStatuses(job.id).catch((error) => setFault(error.message));
    return () => closeStatuses(job.id);
  }, [job.id]);
  const total = grid?.job === job.id ? grid.numbers.length : 0;
  const box = useRef(null);
  const width_px = useWidth(box);
  const layout = gridOf(total || job.frames_total, width_px); // Its room is there before the statuses are.
  const named = picked ?? (shown || null);
  // The viewer shows the last frame that is done, if the address names none.
  const newest = total ? grid.statuses.lastIndexOf(STATUSES.indexOf("done")) : 0;
  const square = total ? Math.max(0, named === null ? newest : placeOfFrame(grid.numbers, named)) : 0;
  const canvas = useCanvas(layout, grid, square, width_px);
  const open = (at) => {
    if (at < 0) return;
    setPicked(grid.numbers[at]);
    if (STATUSES[grid.statuses[at]] === "done") write({ frame: grid.numbers[at] }, { replace: false });
  };
  const close = () => setPicked(null);
  const at = (event) => squareAt(layout, event.offsetX, event.offsetY);
  const key = (event) => {
    if (event.key === "Enter" || event.key === " ") open(square);
    const next = squareByKey(layout, square, event.key);
    if (next === null && event.key !== " ") return;
    event.preventDefault();
    if (next !== null) setPicked(grid.numbers[next]);
  };
  const words = (place) => `Frame ${grid.numbers[place]}, ${STATUSES[grid.statuses[place]]}`;
  return html`
    <div class="grid" role="group" aria-label="All frames by status">
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      <${Legend} grid=${grid} total=${total} />
      <div ref=${box} class="squares" style=${{ height: `${layout.height_px}px` }}>
        ${
          total > 0 &&
          html`<canvas ref=${canvas} tabindex="0" role="slider" aria-label="Frame" aria-valuemin="1"
            aria-valuemax=${total} aria-valuenow=${square + 1} aria-valuetext=${words(square)} onKeyDown=${key}
            onPointerMove=${(event) => setHover(at(event))} onPointerLeave=${() => setHover(-1)}
            onClick=${(event) => open(at(event))}></canvas>`
        }
      </div>
      <p class="numbers pointed">${total > 0 ? words(hover < 0 ? square : hover) : ""}</p>
      ${picked !== null && html`<${FrameTasks} key=${picked} job=${job} frame=${picked} close=${close} />`}
    </div>
  `;
}

function Legend({ grid, total }) {
  if (!total) return html`<ul class="legend"></ul>`;
  const counts = countsOf(grid.statuses);
  const failed = textOf(grid, "failed", MOST_RANGES);
  return html`
    <ul class="legend">
      ${STATUSES.map(
        (status, code) =>
          counts[code] > 0 && html`<li key=${status} class=${status}>${count(counts[code])} ${status}</li>`,
      )}
    </ul>
    ${failed && html`<p class="fault">Failed frames: ${failed}</p>`}
  `;
}

function useWidth(box) {
  const [width_px, setWidth] = useState(0);
  useLayoutEffect(() => {
    setWidth(box.current.clientWidth);
    const watch = new ResizeObserver(([entry]) => setWidth(Math.floor(entry.contentRect.width)));
    watch.observe(box.current);
    return () => watch.disconnect();
  }, []);
  return width_px;
}

// The canvas is drawn anew, at most once a frame of the screen, when a status, the width or the theme changes.
function useCanvas(layout, grid, square, width_px) {
  const canvas = useRef(null);
  const [isDark, setDark] = useState(dark.matches);
  useEffect(() => {
    const follow = () => setDark(dark.matches);
    dark.addEventListener("change", follow);
    return () => dark.removeEventListener("change", follow);
  }, []);
  useLayoutEffect(() => {
    if (!canvas.current || !width_px) return undefined;
    const frame = requestAnimationFrame(() => draw(canvas.current, layout, grid.statuses, square, width_px));
    return () => cancelAnimationFrame(frame);
  }, [grid?.version, square, width_px, layout.total, isDark]);
  return canvas;
}

function draw(canvas, layout, statuses, square, width_px) {
  if (!canvas) return;
  const scale = devicePixelRatio || 1;
  const [width, height] = [Math.round(width_px * scale), Math.round(layout.height_px * scale)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d");
  const style = getComputedStyle(canvas);
  const colours = COLOURS.map((name) => style.getPropertyValue(name));
  const size_px = layout.step_px - (layout.step_px > 5 ? 2 : 1);
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width_px, layout.height_px);
  colours.forEach((colour, code) => {
    context.fillStyle = colour;
    for (let at = 0; at < statuses.length; at++) {
      if (statuses[at] !== code) continue;
      const [x, y] = placeOf(layout, at);
      if (STATUSES[code] === "skipped") context.fillRect(x, y + size_px / 3, size_px, size_px / 3);
      else context.fillRect(x, y, size_px, size_px);
    }
  });
  markFailed(context, layout, statuses, size_px, style.getPropertyValue("--sheet"));
  const [x, y] = placeOf(layout, square);
  context.strokeStyle = style.getPropertyValue("--ink");
  context.lineWidth = 1.5;
  context.strokeRect(x - 0.25, y - 0.25, size_px + 0.5, size_px + 0.5);
}

function markFailed(context, layout, statuses, size_px, colour) {
  if (size_px < 5) return;
  context.strokeStyle = colour;
  context.lineWidth = size_px / 8;
  context.beginPath();
  for (let at = 0; at < statuses.length; at++) {
    if (STATUSES[statuses[at]] !== "failed") continue;
    const [x, y] = placeOf(layout, at);
    context.moveTo(x, y);
    context.lineTo(x + size_px, y + size_px);
    context.moveTo(x + size_px, y);
    context.lineTo(x, y + size_px);
  }
  context.stroke();
}
