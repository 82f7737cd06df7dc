// The depth map over a picture, with its legend in mm; it follows the eye.
import { useLayoutEffect, useRef } from "preact/hooks";
import { useRequest } from "../../api/request.js";
import { quantity } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { deepestShown, gradientOf, overlayPixels, seenFrom } from "./depth_map.js";
import { depthMaps } from "./depth_shelf.js";
import { numbersAt } from "../painting/views.js";

const PAUSE_MS = 150;
const SOURCES = { truth: "true depth", estimate: "estimated depth" };

export const DepthToggle = ({ stand, change }) => html`
  <button
    aria-pressed=${stand.showsDepth}
    class="toggle"
    title="Colours show how far things are in front of the display or behind it."
    onClick=${() => change({ showsDepth: !stand.showsDepth })}
  >
    Depth map
  </button>
`;

// `follow` is a ref with the present place of the eye and the function `draw`, which is called with every next one; a
// mode without a moving eye shows the depth map of the middle.
/** @param {{frameViews: any, stand: any, styleOf: any, follow: any, movesEye: boolean}} properties */
export function DepthOverlay({ frameViews, stand, styleOf, follow, movesEye }) {
  const url = frameViews && stand.showsDepth ? frameViews.depth_map.url : null;
  const found = useRequest(url, () => depthMaps.get(url), PAUSE_MS);
  if (!url) return null;
  const size = { width: frameViews.view_cols, height: frameViews.view_rows };
  const map = found.value?.rows === size.height && found.value.cols === size.width ? found.value : null;
  return html`
    ${
      map &&
      html`<${Colours} map=${map} frameViews=${frameViews} place=${stand.place} style=${styleOf(size)}
        follow=${follow} movesEye=${movesEye} />`
    }
    <${Legend} map=${map} source=${frameViews.depth_map.source} fault=${found.fault} />
  `;
}

function Colours({ map, frameViews, place, style, follow, movesEye }) {
  const canvas = useRef(null);
  useLayoutEffect(() => {
    const deepest_mm = deepestShown(map);
    const context = canvas.current.getContext("2d");
    const draw = (at) => {
      const [u, v] = at ? numbersAt(frameViews, at) : frameViews.centre;
      const away = [u - frameViews.centre[0], v - frameViews.centre[1]];
      const seen = seenFrom(map, away, frameViews.depths.lenses_per_mm);
      context.putImageData(new ImageData(overlayPixels(seen, deepest_mm), map.cols, map.rows), 0, 0);
    };
    draw(movesEye ? (follow.current.place ?? place) : null);
    if (!movesEye) return undefined;
    follow.current.draw = draw;
    return () => delete follow.current.draw;
  }, [map, frameViews, place?.x, place?.y]);
  return html`
    <canvas ref=${canvas} class="depths" width=${map.cols} height=${map.rows} style=${style}
      aria-hidden="true"></canvas>
  `;
}

function Legend({ map, source, fault }) {
  const deepest_mm = map ? deepestShown(map) : null;
  const words = fault || (map ? SOURCES[source] : `${SOURCES[source]} …`);
  return html`
    <div class="legend" role="status">
      ${
        map &&
        html`
          <div class="scale" style=${{ background: gradientOf(deepest_mm) }}></div>
          <div class="marks numbers">
            <span>−${quantity(deepest_mm)}</span><span>0</span><span>+${quantity(deepest_mm)} mm</span>
          </div>
        `
      }
      <span>${words}</span>
      ${map && html`<span class="unseen">behind the display to in front of it</span>`}
    </div>
  `;
}
