// One frame large: as captured, orthoscopic, or as views; pixel by pixel when wanted.
// Enlarged, its pixels are squares: what lies under each lens is what there is to see.
//   ← →  other frames     1 2 3  other pictures     + - 0  scale     Esc  back
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { asPng } from "./api.js";
import { by } from "./format.js";
import { html } from "./html.js";

const PICTURES = [
  ["integral", "Integral"],
  ["orthoscopic", "Orthoscopic"],
  ["views", "Views"],
];
const SCALES = [0, 1, 2, 4, 8]; // 0: as large as there is room

export function Lightbox({ frames, frame, show }) {
  const dialog = useRef(null);
  const centre = useRef(null);
  const [picture, setPicture] = useState("integral");
  const [scale, setScale] = useState(0);
  const [size, setSize] = useState(null);
  const [state, setState] = useState("loading");
  const index = frames.findIndex((item) => item.frame === frame);
  const item = frames[index];
  const url = item && asPng(item[picture]);

  useEffect(() => {
    dialog.current.showModal();
  }, []);
  useEffect(() => setState("loading"), [url]);
  useLayoutEffect(() => centre.current?.(), [scale]);

  const step = (by) => frames[index + by] && show(frames[index + by].frame);
  const scaleTo = (value) => {
    centre.current = keepCentre(dialog.current.querySelector(".stage"));
    setScale(value);
  };
  const zoom = (by) => scaleTo(SCALES[Math.max(0, Math.min(SCALES.length - 1, SCALES.indexOf(scale) + by))]);
  const keys = {
    ArrowLeft: () => step(-1),
    ArrowRight: () => step(1),
    "+": () => zoom(1),
    "=": () => zoom(1),
    "-": () => zoom(-1),
    0: () => scaleTo(0),
    1: () => setPicture("integral"),
    2: () => setPicture("orthoscopic"),
    3: () => setPicture("views"),
  };
  const press = (event) => {
    // With a scaled picture in focus the arrows move about in it.
    if (event.target.matches(".stage") && scale && event.key.startsWith("Arrow")) return;
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  };
  const loaded = ({ target }) => {
    setState("ready");
    setSize({ width: target.naturalWidth, height: target.naturalHeight });
  };
  const stage = dialog.current?.querySelector(".stage");
  const isEnlarged = size && (scale || (size.width <= stage.clientWidth && size.height <= stage.clientHeight));
  const style = scale && size ? { width: `${size.width * scale}px` } : {};
  return html`
    <dialog ref=${dialog} class="lightbox" aria-label="Frame ${frame}" onClose=${() => show(null)} onKeyDown=${press}>
      <div class="bar">
        <div class="choice" role="group" aria-label="Picture">
          ${PICTURES.map(([name, title]) => html`
            <button key=${name} aria-pressed=${picture === name} onClick=${() => setPicture(name)}>${title}</button>
          `)}
        </div>
        <div class="choice" role="group" aria-label="Scale">
          ${SCALES.map((value) => html`
            <button key=${value} aria-pressed=${scale === value} onClick=${() => scaleTo(value)}>
              ${value ? `${value}×` : "Fit"}
            </button>
          `)}
        </div>
        <button class="close" onClick=${() => dialog.current.close()} aria-label="Close">✕</button>
      </div>
      <div class="stage ${scale ? "scaled" : "fit"}" tabindex="0">
        ${url && html`
          <img key=${picture} class="${state} ${isEnlarged ? "pixels" : ""}" src=${url} style=${style}
            onLoad=${loaded} onError=${() => setState("broken")} alt="Frame ${frame}, ${picture}" />
        `}
        ${state === "broken" && html`<p class="fault" role="alert">This picture cannot be shown.</p>`}
      </div>
      <div class="bar">
        <button onClick=${() => step(-1)} disabled=${index <= 0} aria-label="Frame before">←</button>
        <button onClick=${() => step(1)} disabled=${index + 1 >= frames.length} aria-label="Next frame">→</button>
        <span class="numbers" aria-live="polite">
          Frame ${frame}${size && state === "ready" && ` · ${by(size.width, size.height)} px`}
        </span>
        <span class="files">
          <a href=${url} download>PNG</a>
          ${item && html`<a href=${item[picture]} download>EXR</a>`}
        </span>
      </div>
    </dialog>
  `;
}

// Returns what scrolls the stage so that the middle stays the middle.
function keepCentre(stage) {
  const across = (stage.scrollLeft + stage.clientWidth / 2) / stage.scrollWidth;
  const down = (stage.scrollTop + stage.clientHeight / 2) / stage.scrollHeight;
  return () => {
    stage.scrollLeft = across * stage.scrollWidth - stage.clientWidth / 2;
    stage.scrollTop = down * stage.scrollHeight - stage.clientHeight / 2;
  };
}
