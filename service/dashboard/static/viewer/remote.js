// A picture that the service makes on demand; the previous one stays until the next is loaded.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { useRequest } from "../api/request.js";
import { getPicture } from "../api/operations.js";
import { html } from "../shared/html.js";

const PAUSE_MS = 120;

// `styleOf(size)` returns the style of the rectangle in which a picture of this size stands on the stage; `busy` is a
// ref that says whether a picture is on its way. `onSize` is called with its size.
export function RemotePicture({ url, label, isSmooth, styleOf, onSize, busy }) {
  const canvas = useRef(null);
  const { value: bitmap, fault, isWaiting } = useRequest(url, (signal) => getPicture(url, signal), PAUSE_MS);
  busy.current = isWaiting;
  useLayoutEffect(() => {
    if (!bitmap) return;
    canvas.current.width = bitmap.width;
    canvas.current.height = bitmap.height;
    canvas.current.getContext("2d").drawImage(bitmap, 0, 0);
    onSize({ width: bitmap.width, height: bitmap.height });
  }, [bitmap]);
  useEffect(() => () => bitmap?.close(), [bitmap]);
  return html`
    <canvas
      ref=${canvas}
      role="img"
      aria-label=${label}
      aria-busy=${isWaiting}
      style=${bitmap ? styleOf(bitmap) : {}}
      class="${isWaiting ? "loading" : ""} ${bitmap ? "" : "empty"} ${isSmooth ? "" : "pixels"}"
    ></canvas>
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
  `;
}
