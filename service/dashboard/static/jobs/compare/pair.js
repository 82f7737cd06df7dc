// Two pictures that move together: one eye, one mode, one depth and one zoom for both.
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { pictureUrl } from "../../api/operations.js";
import { html } from "../../shared/html.js";
import { isExact } from "../../viewer/painting/atlases.js";
import { GRAPHICS, ViewCanvas } from "../../viewer/painting/canvas.js";
import { Eye } from "../../viewer/hand/eye.js";
import { useGestures } from "../../viewer/hand/gestures.js";
import { MODES } from "../../viewer/modes/index.js";
import { hovered, turned } from "../../viewer/hand/motion.js";
import { RemotePicture } from "../../viewer/remote.js";
import { roundedPlace } from "../../viewer/stand.js";
import { useAtlas, useAtlases } from "../../viewer/painting/use_atlas.js";
import { useGuide } from "../../viewer/depth/use_guide.js";
import { useMotionPreference, useSize } from "../../viewer/use_screen.js";
import { FIT, panned, partAt, rectOf, zoomedAt } from "../../viewer/hand/zoom.js";

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const ZOOM_STEP = 1.25;
const MIDDLE = { x: 0, y: 0 };

// The eye of two stages: {eye, draw(), draws}, where `draws` are the functions that ask for their next screen frames.
export function useSharedEye(place) {
  const isCalm = useMotionPreference();
  const shared = useRef(null);
  if (!shared.current) {
    const eye = new Eye(place ?? MIDDLE, isCalm);
    eye.hover(place ?? MIDDLE); // It does not sway: two pictures are looked at for what differs.
    const draws = [{ current: () => {} }, { current: () => {} }];
    shared.current = { eye, draws, draw: () => draws.forEach((each) => each.current()) };
  }
  const { eye, draw } = shared.current;
  eye.isCalm = isCalm;
  useLayoutEffect(() => {
    if (place) eye.hold(place);
    else {
      eye.free(performance.now());
      eye.hover(MIDDLE);
    }
    draw();
  }, [place?.x, place?.y]);
  return shared.current;
}

// `side` is 0 or 1; `lose` is called when WebGL2 is missing or lost, and `tell` with the description of the views.
export function Stage({ job, side, frame, stand, change, shared, lose, tell }) {
  const box = useRef(null);
  const stage = useRef(null);
  const busy = useRef(false);
  const [isFocused, setFocused] = useState(false);
  const room = useSize(box, ".stage");
  const kind = MODES[stand.mode];
  const isKnown = frame !== undefined;
  const found = useAtlas(useAtlases(job), isKnown ? frame : null, { isPainted: true, wantsWhole: true });
  const { guide, isWaiting } = useGuide(found.atlas, kind.movesEye === true);
  const views = found.frameViews ?? found.atlas?.frameViews ?? null;
  useEffect(() => views && tell(side, views), [views]);
  const { eye } = shared;
  const size = views && { width: views.view_cols, height: views.view_rows };
  const filled = views ? kind.filled(views, { ...stand, place: stand.place ?? eye.goal }) : stand;
  const given = { job: job.id, frame, frameViews: views, stand: filled, change, isPainted: true, size, room };
  const isPainted = !(kind.needsAll && views && !isExact(views));
  const label = isKnown ? `Frame ${frame}, ${kind.name}, ${side ? "second" : "first"} job` : "No picture";

  const zoomTo = (zoom) => change({ zoom });
  const gestures = useGestures(stage, {
    isPanning: () => !kind.movesEye,
    hasWheel: () => isFocused,
    grab: () => {
      const from = eye.place;
      return (across, down) => {
        eye.drag(turned(from, across / room.width, down / room.height), performance.now());
        shared.draw();
      };
    },
    release: () => eye.isDragged && change({ place: roundedPlace(eye.release(performance.now())) }),
    pan: (across, down) => size && stand.zoom.scale > 1 && zoomTo(panned(stand.zoom, across, down, size, room)),
    zoom: (factor, point) => size && zoomTo(zoomedAt(stand.zoom, factor, point, size, room)),
    hover: (point) => {
      if (!kind.movesEye || !eye.isFree) return;
      eye.hover(hovered(point.x / room.width - 0.5, point.y / room.height - 0.5));
      shared.draw();
    },
    leave: () => {
      if (!eye.isFree) return;
      eye.hover(MIDDLE);
      shared.draw();
    },
    click: (point) => {
      if (kind.movesEye && eye.isFree) change({ place: roundedPlace(eye.goal) });
      const part = size && partAt(stand.zoom, point, size, room);
      if (!kind.clicked || !part || part.some((each) => each < 0 || each > 1)) return;
      Promise.resolve(kind.clicked(given, ...part)).then((patch) => patch && change(patch));
    },
  });
  const press = (event) => {
    const middle = { x: room.width / 2, y: room.height / 2 };
    const zoomed = (factor) => size && zoomTo(zoomedAt(stand.zoom, factor, middle, size, room));
    const keys = {
      "+": () => zoomed(ZOOM_STEP),
      "=": () => zoomed(ZOOM_STEP),
      "-": () => zoomed(1 / ZOOM_STEP),
      0: () => zoomTo(FIT),
    };
    const direction = ARROWS[event.key];
    const act = direction ? () => views && change(kind.stepped(given, direction)) : keys[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  };
  const styleOf = (picture) => {
    const { left, top, width, height } = rectOf(stand.zoom, picture, room);
    return { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` };
  };
  const url = isKnown && views && !isPainted ? pictureUrl(job.id, frame, ...kind.query(given)) : null;
  return html`
    <div ref=${box} onKeyDown=${press}>
      <div ref=${stage} class="stage ${kind.movesEye ? "grabbed" : "aimed"}" tabindex="0" role="application"
        aria-label=${label} aria-describedby="pair-hint"
        onFocus=${() => setFocused(true)} onBlur=${() => setFocused(false)} ...${gestures}>
        <${ViewCanvas} atlas=${isPainted ? found.atlas : null} guide=${guide} label=${label} zoom=${stand.zoom}
          step=${(now_ms) => kind.movesEye === true && eye.step(now_ms)}
          paint=${(painter) => kind.paint(painter, eye.place, filled, given)}
          draw=${shared.draws[side]} isWaiting=${found.isWaiting || isWaiting} isRecorded=${false}
          onGraphics=${(state) => state !== GRAPHICS.there && lose()} />
        ${
          url &&
          html`<${RemotePicture} url=${url} label=${label} isSmooth=${true} styleOf=${styleOf} onSize=${() => {}}
            busy=${busy} />`
        }
      </div>
    </div>
    ${found.fault && html`<p class="fault" role="alert">${found.fault}</p>`}
  `;
}
