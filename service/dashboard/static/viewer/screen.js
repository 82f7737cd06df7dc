// The stage of the viewer: the picture of the mode, and the hand that turns, moves and enlarges it.
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { html } from "../shared/html.js";
import { GRAPHICS, ViewCanvas, WITHOUT_GRAPHICS } from "./painting/canvas.js";
import { Eye } from "./hand/eye.js";
import { useGestures } from "./hand/gestures.js";
import { hovered, turned } from "./hand/motion.js";
import { RemotePicture } from "./remote.js";
import { rounded, roundedPlace } from "./stand.js";
import { panned, partAt, rectOf, zoomedAt } from "./hand/zoom.js";

// `hand` is a ref through which the keys of the viewer move eye and zoom.
export function Screen({ given, kind, item, url, label, atlas, guide, isWaiting, isCalm, ...rest }) {
  const { isFull, isRecorded, hand, busy, graphics, onGraphics, onSize, onSteer } = rest;
  const { stand, change, isPainted, size, room } = given;
  const stage = useRef(null);
  const draw = useRef(() => {});
  const marker = useRef(null);
  // The place of the eye, and the function of an overlay that follows it.
  const follow = useRef(/** @type {any} */ ({}));
  const eye = useRef(null);
  const [isFocused, setFocused] = useState(false);
  const isSteered = isPainted && kind.movesEye === true;
  const home = given.home;
  eye.current ??= new Eye(stand.place ?? home, isCalm);
  eye.current.isCalm = isCalm;

  // A place of the state holds the eye, and none lets it go.
  useLayoutEffect(() => {
    if (stand.place) eye.current.hold(stand.place);
    else eye.current.free(performance.now());
    draw.current();
  }, [stand.place?.x, stand.place?.y]);
  useLayoutEffect(() => {
    // The middle view is sharp, and nothing moves before somebody steers.
    if (isCalm && !stand.place) eye.current.hover(home);
  }, [home.x, home.y]);

  const keep = (place) => change({ place: roundedPlace(place) });
  const zoomTo = ({ scale, x, y }) => change({ zoom: { scale: rounded(scale), x: rounded(x), y: rounded(y) } });
  const away = (point) => [point.x / room.width - 0.5, point.y / room.height - 0.5];
  const isEnlarged = stand.zoom.scale > 1;
  const gestures = useGestures(stage, {
    isPanning: () => !isSteered && !kind.dragged,
    hasWheel: () => isFull || isFocused,
    grab: () => {
      if (isSteered) {
        const from = eye.current.place;
        return (across, down) => {
          eye.current.drag(turned(from, across / room.width, down / room.height), performance.now());
          draw.current();
        };
      }
      const from = given;
      return kind.dragged && ((across, down) => change(kind.dragged(from, across / room.width, down / room.height)));
    },
    release: () => isSteered && eye.current.isDragged && keep(eye.current.release(performance.now())),
    pan: (across, down) => isEnlarged && size && zoomTo(panned(stand.zoom, across, down, size, room)),
    zoom: (factor, point) => size && zoomTo(zoomedAt(stand.zoom, factor, point, size, room)),
    hover: (point) => {
      if (!isSteered || !eye.current.isFree) return;
      onSteer();
      eye.current.hover(hovered(...away(point)));
      draw.current();
    },
    leave: () => {
      if (!isSteered || !eye.current.isFree) return;
      eye.current.leave(performance.now());
      draw.current();
    },
    click: (point) => {
      if (isSteered && eye.current.isFree) keep(eye.current.place);
      const part = size && partAt(stand.zoom, point, size, room);
      if (!kind.clicked || !part || part.some((each) => each < 0 || each > 1)) return;
      Promise.resolve(kind.clicked(given, ...part)).then((patch) => patch && change(patch));
    },
  });
  hand.current = {
    place: () => eye.current.goal,
    stage: stage.current,
    draw: () => draw.current(),
    zoom: (factor) => size && zoomTo(zoomedAt(stand.zoom, factor, middle(room), size, room)),
    pan: (across, down) => size && zoomTo(panned(stand.zoom, across * room.width, down * room.height, size, room)),
    tilt: (place) => {
      if (!isSteered || !eye.current.isFree) return;
      onSteer();
      if (place) eye.current.hover(place);
      else eye.current.leave(performance.now());
      draw.current();
    },
  };

  const step = (now_ms) => {
    const isMoving = isSteered && eye.current.step(now_ms);
    marker.current?.setAttribute("cx", 50 + 42 * eye.current.now.x);
    marker.current?.setAttribute("cy", 50 + 42 * eye.current.now.y);
    follow.current.place = eye.current.place;
    follow.current.draw?.(eye.current.place);
    return isMoving;
  };
  const styleOf = (picture) => {
    const { left, top, width, height } = rectOf(stand.zoom, picture, room);
    return { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` };
  };
  return html`
    <div
      ref=${stage}
      class="stage ${kind.movesEye || kind.dragged || isEnlarged ? "grabbed" : ""} ${kind.clicked ? "aimed" : ""}"
      tabindex="0"
      role="application"
      aria-label=${label}
      aria-describedby="look-hint"
      onFocus=${() => setFocused(true)}
      onBlur=${() => setFocused(false)}
      ...${gestures}
    >
      ${given.absence && html`<p class="soon">${given.absence}</p>`}
      ${item?.thumbUrl && html`<img class="poster" src=${item.thumbUrl} alt="" />`}
      ${
        kind.Picture &&
        html`
          <${kind.Picture} ...${given} item=${item} label=${label} styleOf=${styleOf} onSize=${onSize} busy=${busy} />
        `
      }
      ${
        kind.paint &&
        (isPainted || graphics === GRAPHICS.lost) &&
        html`<${ViewCanvas}
          atlas=${atlas}
          guide=${guide}
          label=${label}
          zoom=${stand.zoom}
          step=${step}
          paint=${(painter) => kind.paint(painter, eye.current.place, stand, given)}
          draw=${draw}
          isRecorded=${isRecorded}
          isWaiting=${isWaiting}
          onGraphics=${onGraphics}
        />`
      }
      ${
        !kind.Picture &&
        !isPainted &&
        url &&
        html`<${RemotePicture}
          url=${url}
          label=${label}
          isSmooth=${stand.isSmooth || !kind.paint}
          styleOf=${styleOf}
          onSize=${onSize}
          busy=${busy}
        />`
      }
      ${kind.paint && html`<p class="told" role="status">${WITHOUT_GRAPHICS[graphics]}</p>`}
      ${kind.Overlay && html`<${kind.Overlay} ...${given} styleOf=${styleOf} follow=${follow} />`}
      ${isSteered && html`<${Place} place=${eye.current.now} marker=${marker} />`}
    </div>
  `;
}

const middle = ({ width, height }) => ({ x: width / 2, y: height / 2 });

// The place of the eye among the views.
const Place = ({ place, marker }) => html`
  <svg class="place" viewBox="0 0 100 100" aria-hidden="true">
    <rect x="1" y="1" width="98" height="98" rx="8" />
    <circle ref=${marker} r="7" cx=${50 + 42 * place.x} cy=${50 + 42 * place.y} />
  </svg>
`;
