// One static picture of a frame, scaled to fit or by an integer. Enlarged pixels are squares, so that the cell under
// each lens is visible.
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { asPng, link } from "../api/operations.js";
import { Choice } from "../shared/choice.js";
import { Footer } from "./footer.js";
import { by } from "../shared/format.js";
import { html } from "../shared/html.js";

const SCALES = [0, 1, 2, 4, 8]; // 0: scaled to fit
const TITLES = SCALES.map((value) => [value, value ? `${value}×` : "Fit"]);

export function StaticPicture({ item, frame, picture, keys, foot }) {
  const stage = useRef(null);
  const centre = useRef(null);
  const [scale, setScale] = useState(0);
  const [size, setSize] = useState(null);
  const [state, setState] = useState("loading");
  const url = item && asPng(item[picture]);
  useEffect(() => setState("loading"), [url]);
  useLayoutEffect(() => centre.current?.(), [scale]);

  const scaleTo = (value) => {
    centre.current = keepCentre(stage.current);
    setScale(value);
  };
  const zoom = (by) => scaleTo(SCALES[Math.max(0, Math.min(SCALES.length - 1, SCALES.indexOf(scale) + by))]);
  keys.current = { "+": () => zoom(1), "=": () => zoom(1), "-": () => zoom(-1), 0: () => scaleTo(0) };
  const loaded = ({ target }) => {
    setState("ready");
    setSize({ width: target.naturalWidth, height: target.naturalHeight });
  };
  const room = stage.current;
  const isEnlarged = size && (scale || (size.width <= room.clientWidth && size.height <= room.clientHeight));
  const style = scale && size ? { width: `${size.width * scale}px` } : {};
  return html`
    <div ref=${stage} class="stage ${scale ? "scaled" : "fit"}" tabindex="0">
      ${
        url &&
        html`
        <img key=${picture} class="${state} ${isEnlarged ? "pixels" : ""}" src=${url} style=${style}
          onLoad=${loaded} onError=${() => setState("broken")} alt="Frame ${frame}, ${picture}" />
      `
      }
      ${state === "broken" && html`<p class="fault" role="alert">This picture cannot be shown.</p>`}
    </div>
    <div class="bar controls">
      <${Choice} name="Scale" choices=${TITLES} chosen=${scale} choose=${scaleTo} />
    </div>
    <${Footer} ...${foot} said=${size && state === "ready" && `${by(size.width, size.height)} px`}>
      <a href=${url} download>PNG</a>
      ${item && html`<a href=${link(item[picture])} download>EXR</a>`}
    <//>
  `;
}

// Returns a function that scrolls the stage so that its centre stays in place.
function keepCentre(stage) {
  const across = (stage.scrollLeft + stage.clientWidth / 2) / stage.scrollWidth;
  const down = (stage.scrollTop + stage.clientHeight / 2) / stage.scrollHeight;
  return () => {
    stage.scrollLeft = across * stage.scrollWidth - stage.clientWidth / 2;
    stage.scrollTop = down * stage.scrollHeight - stage.clientHeight / 2;
  };
}
