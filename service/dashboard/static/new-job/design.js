// The design of a job: the drawing of the optical bench, the main numbers, and the warnings.
import { useEffect, useRef, useState } from "preact/hooks";
import { postDesign, postDrawing } from "../api/operations.js";
import { by, duration, quantity } from "../shared/format.js";
import { html } from "../shared/html.js";

// The pause after the last key stroke, so that no request is sent for every digit.
const PAUSE_MS = 400;
const NOTHING = { numbers: null, drawing: "", fault: "" };

export function Design({ spec }) {
  const [found, setFound] = useState(NOTHING);
  useEffect(() => {
    if (!spec) {
      setFound(NOTHING);
      return undefined;
    }
    let isWanted = true;
    const put = (value) => isWanted && setFound({ ...NOTHING, ...value });
    const ask = () =>
      Promise.all([postDesign(spec), postDrawing(spec)]).then(
        ([numbers, drawing]) => put({ numbers, drawing }),
        (error) => put({ fault: error.message }),
      );
    const timer = setTimeout(ask, PAUSE_MS);
    return () => {
      isWanted = false;
      clearTimeout(timer);
    };
  }, [JSON.stringify(spec)]);
  if (found.fault) return html`<p class="fault" role="status">${found.fault}</p>`;
  if (!found.numbers) return null;
  const { numbers } = found;
  return html`
    <section class="design" aria-label="Design">
      <${Drawing} svg=${found.drawing} />
      <dl>${facts(numbers).map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>
      <p class="numbers">${numbers.mla_place_words}</p>
      <p class=${numbers.depth_budget === "fits" ? "numbers" : "numbers look"}>${numbers.depth_budget_words}</p>
      ${numbers.warnings
        .filter((warning) => warning !== numbers.depth_budget_words)
        .map((warning) => html`<p class="numbers look">${warning}</p>`)}
    </section>
  `;
}

// The style sheet of the page colours the drawing; the drawing's own colours are for use as a file. The style element
// is removed from the text, because the security policy reports it even when it is only parsed.
function Drawing({ svg }) {
  const frame = useRef(null);
  useEffect(() => {
    const bare = svg.replace(/<style>.*?<\/style>/s, "");
    const drawing = new DOMParser().parseFromString(bare, "image/svg+xml").documentElement;
    frame.current.replaceChildren(document.importNode(drawing, true));
  }, [svg]);
  return html`<div class="bench" ref=${frame}></div>`;
}

const mm = (length) => (length === null ? "–" : `${quantity(length)} mm`);

function facts(design) {
  return [
    design.efl_mm !== null && ["Focal length", mm(design.efl_mm)],
    design.f_number !== null && ["F-number", `${quantity(design.f_number)}, array ${quantity(design.mla_f_number)}`],
    design.mla_behind_lens_mm !== null && ["Array behind the lens", mm(design.mla_behind_lens_mm)],
    design.image_depth_mm !== null && ["Image depth", mm(design.image_depth_mm)],
    ["Shown", `${mm(design.s_far_mm)} to ${mm(design.s_near_mm)}`],
    ["Views", `${quantity(design.views)} of ${by(design.view_cols_px, design.view_rows_px)} px`],
    ["Viewing angle", `${quantity(design.viewing_angle_deg)}°`],
    ["Viewing zone", `${mm(design.viewing_zone_mm)} at ${mm(design.viewing_distance_mm)}`],
    ["Size", `${quantity(design.width_mm)} × ${quantity(design.height_mm)} mm`],
    ["Gap, real", mm(design.gap_real_physical_mm)],
    ["Gap, virtual", mm(design.gap_virtual_physical_mm)],
    ["CPU a frame", `about ${duration(design.frame_cpu_s)}`],
  ].filter(Boolean);
}
