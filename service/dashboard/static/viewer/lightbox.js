// One frame in full size: a static picture of it, or the interactive view.
//   ← →  other frames, or the eye or depth of the mode     Page Up, Page Down  other frames     Esc  close
//   1 2 3 4 5 6  pictures and modes                        + - 0  scale
import { useEffect, useRef, useState } from "preact/hooks";
import { Choice } from "../shared/choice.js";
import { html } from "../shared/html.js";
import { Viewer } from "./viewer.js";
import { START } from "./stand.js";
import { StaticPicture } from "./picture.js";

const PICTURES = [
  ["integral", "Integral"],
  ["orthoscopic", "Orthoscopic"],
  ["views", "Views"],
];
const LOOKS = [
  ["look", "Look around"],
  ["focus", "Refocus"],
  ["observer", "As seen"],
];

export function Lightbox({ job, frames, frame, show }) {
  const dialog = useRef(null);
  const own = useRef({}); // The keys of the picture or mode.
  const [mode, setMode] = useState("integral");
  const [stand, setStand] = useState(START); // The state of the interactive view, which all frames share.
  const index = frames.findIndex((item) => item.frame === frame);
  useEffect(() => {
    dialog.current.showModal();
  }, []);

  const step = (by) => frames[index + by] && show(frames[index + by].frame);
  const modes = [...PICTURES, ...LOOKS].map(([name], place) => [place + 1, () => setMode(name)]);
  const frameKeys = { ArrowLeft: -1, ArrowRight: 1, PageUp: -1, PageDown: 1 };
  const keys = Object.fromEntries([...modes, ...Object.entries(frameKeys).map(([key, by]) => [key, () => step(by)])]);
  const press = (event) => {
    // In a scaled picture the arrow keys scroll, and in an input field they edit.
    if (event.target.matches(".stage.scaled") && event.key.startsWith("Arrow")) return;
    if (event.target.matches("input") || event.ctrlKey || event.metaKey || event.altKey) return;
    const act = own.current[event.key] ?? keys[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  };
  const change = (patch) => setStand((before) => ({ ...before, ...patch }));
  const foot = { frame, step, isFirst: index <= 0, isLast: index + 1 >= frames.length };
  const isStill = PICTURES.some(([name]) => name === mode);
  return html`
    <dialog ref=${dialog} class="lightbox" aria-label="Frame ${frame}" onClose=${() => show(null)} onKeyDown=${press}>
      <div class="bar">
        <${Choice} name="Picture" choices=${PICTURES} chosen=${mode} choose=${setMode} />
        <${Choice} name="Look" choices=${LOOKS} chosen=${mode} choose=${setMode} />
        <button class="close" onClick=${() => dialog.current.close()} aria-label="Close">✕</button>
      </div>
      ${
        isStill
          ? html`<${StaticPicture} item=${frames[index]} frame=${frame} picture=${mode} keys=${own} foot=${foot} />`
          : html`
            <${Viewer} job=${job} frame=${frame} mode=${mode} stand=${stand} change=${change} keys=${own}
              foot=${foot} />
          `
      }
    </dialog>
  `;
}
