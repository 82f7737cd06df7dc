// A picture that the service makes when it is asked; the last one stays until the next is there.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { useAnswer } from "./answer.js";
import { getPicture } from "./api.js";
import { html } from "./html.js";

const PAUSE_MS = 120;

export function Fetched({ url, label, isSmooth }) {
  const canvas = useRef(null);
  const { value: bitmap, fault, isWaiting } = useAnswer(url, (signal) => getPicture(url, signal), PAUSE_MS);
  useLayoutEffect(() => {
    if (!bitmap) return;
    canvas.current.width = bitmap.width;
    canvas.current.height = bitmap.height;
    canvas.current.getContext("2d").drawImage(bitmap, 0, 0);
  }, [bitmap]);
  useEffect(() => () => bitmap?.close(), [bitmap]);
  return html`
    <canvas ref=${canvas} role="img" aria-label=${label} aria-busy=${isWaiting}
      class="${isWaiting ? "loading" : ""} ${bitmap ? "" : "empty"} ${isSmooth ? "" : "pixels"}"></canvas>
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
  `;
}
