// What can be taken home of what is shown: a screenshot, the exact picture as PNG or EXR, and the masters as EXR.
import { useEffect, useRef } from "preact/hooks";
import { link } from "../api/operations.js";
import { html } from "../shared/html.js";

const KINDS = {
  view: "This picture, one pixel per lens",
  refocus: "This picture, one pixel per lens",
  observer: "This picture as an eye sees it",
};
const PAIR = "This pair as two eyes see it";

// `url` is that of the picture of the service, `what` its kind, and `isPair` whether it is for two eyes.
export function Save({ url, what, isPair, item, canvas, name, sheet, recorder }) {
  const menu = useRef(null);
  const close = () => (menu.current.open = false);
  useEffect(() => {
    const leave = ({ target }) => menu.current.contains(target) || close();
    addEventListener("pointerdown", leave);
    return () => removeEventListener("pointerdown", leave);
  }, []);
  const words = isPair ? PAIR : KINDS[what];
  const shoot = () => canvas()?.toBlob((blob) => download(blob, `${name}.png`));
  return html`
    <details ref=${menu} class="menu" onKeyDown=${(event) => event.key === "Escape" && close()}>
      <summary class="button">Save</summary>
      <div onClick=${close}>
        ${!sheet && html`<button onClick=${shoot}>Screenshot (PNG)</button>`}
        ${recorder && html`<button onClick=${recorder.toggle}>Record a video of the stage</button>`}
        ${url && html`<a class="button" href=${url} download>${words} (PNG)</a>`}
        ${url && html`<a class="button" href="${url}&format=exr" download="${name}.exr">${words} (EXR)</a>`}
        ${
          item?.[sheet || "views"] &&
          html`
            <a class="button" href=${link(item[sheet || "views"])} download>
              ${sheet ? "This sheet" : "All views"} (EXR)
            </a>
          `
        }
        ${sheet && item && html`<a class="button" href="${link(item[sheet])}?format=png" download>This sheet (PNG)</a>`}
      </div>
    </details>
  `;
}

export function download(blob, name) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 10_000);
}
