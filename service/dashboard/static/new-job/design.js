// The design of a job beside the form: the drawing of the optical bench, the main numbers, the depth budget, the
// warnings and the cost. Every part has its place before the service answers, so that nothing moves.
import { useEffect, useRef, useState } from "preact/hooks";
import { getSchema, link } from "../api/operations.js";
import { by, bytes, duration, quantity } from "../shared/format.js";
import { html } from "../shared/html.js";
import { useDesign } from "./check.js";
import { pageOfNumber } from "./form/documentation.js";
import { Documented } from "./form/documented.js";
import { words } from "./form/help.js";
import { Limits } from "./limits.js";

export function Design({ spec }) {
  return html`<${DesignPanel} ...${useDesign(spec)} />`;
}

// While the form has an error, the last design is shown, dimmed, and the error stands over its drawing.
/**
 * @param {{ numbers?: any, drawing?: string, limits?: any[], isStale: boolean, problem: any }} design
 */
export function DesignPanel({ numbers, drawing, limits, isStale, problem }) {
  return html`
    <section class="design" aria-label="Design" aria-busy=${isStale && !problem}>
      <div class=${problem ? "stale" : ""}>
        <${Bench} svg=${drawing} problem=${problem} />
        <dl>${facts(numbers).map(([, name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>
        ${
          numbers &&
          html`
            <p class="numbers">${numbers.mla_place_words}</p>
            <p class=${numbers.depth_budget === "fits" ? "numbers" : "numbers look"}>${numbers.depth_budget_words}</p>
            ${numbers.warnings
              .filter((warning) => warning !== numbers.depth_budget_words)
              .map((warning) => html`<p class="numbers look">${warning}</p>`)}
          `
        }
      </div>
      ${limits && html`<${Limits} limits=${limits} />`}
      <${Meanings} />
    </section>
  `;
}

const OLD = " The design is that before it.";

// The drawing, and the same as large as the window.
function Bench({ svg, problem }) {
  const dialog = useRef(null);
  const isOld = problem && svg;
  return html`
    <div class="bench">
      <${Drawing} svg=${svg} />
      <div class="over" role="status">
        ${problem && html`<p><span class="fault">${problem.message}</span>${isOld && OLD}</p>`}
      </div>
      ${svg && html`<button type="button" onClick=${() => dialog.current.showModal()}>Enlarge</button>`}
    </div>
    <dialog ref=${dialog} class="large-bench" aria-label="The optical bench">
      <div class="bench" tabindex="0" role="group" aria-label="Drawing"><${Drawing} svg=${svg} /></div>
      <form method="dialog"><button>Close</button></form>
    </dialog>
  `;
}

// The style sheet of the page colours the drawing; the drawing's own colours are for use as a file. The style element
// is removed from the text, because the security policy reports it even when it is only parsed.
function Drawing({ svg }) {
  const frame = useRef(null);
  useEffect(() => {
    if (!svg) return;
    const bare = svg.replace(/<style>.*?<\/style>/s, "");
    const drawing = new DOMParser().parseFromString(bare, "image/svg+xml").documentElement;
    frame.current.replaceChildren(document.importNode(drawing, true));
  }, [svg]);
  return html`<div class="drawing" ref=${frame}></div>`;
}

// What the numbers mean, in the words of the schema of a design.
function Meanings() {
  const [fields, setFields] = useState(null);
  const load = (event) =>
    event.target.open && !fields && getSchema("design").then((schema) => setFields(schema.properties));
  return html`
    <details class="meanings" onToggle=${load}>
      <summary>What the numbers mean</summary>
      ${
        fields &&
        html`<dl>${facts().map(
          ([field, name]) => html`
        <div><dt><${Documented} page=${pageOfNumber(field)}>${name}<//></dt>
          <dd>${words((fields[field].description || "").replaceAll("\n", " "))}</dd></div>
      `,
        )}</dl>`
      }
      <p><a href=${link("/help/designer.html")} target="_blank">All numbers of a design</a></p>
    </details>
  `;
}

const mm = (length) => (length === null ? "–" : `${quantity(length)} mm`);

const depth = (length) => (length === null ? "–" : quantity(length));

// [the field that explains it, name, value]
function facts(design) {
  const value = (read) => (design ? read(design) : "–");
  return [
    ["cols_px", "Image", value((d) => `${by(d.cols_px, d.rows_px)} px`)],
    ["views", "Views", value((d) => `${quantity(d.views)} of ${by(d.view_cols_px, d.view_rows_px)} px`)],
    ["efl_mm", "Focal length", value((d) => mm(d.efl_mm))],
    [
      "mla_f_number",
      "F-number",
      value((d) => `${d.f_number === null ? "–" : quantity(d.f_number)}, array ${quantity(d.mla_f_number)}`),
    ],
    ["mla_behind_lens_mm", "Array behind lens", value((d) => mm(d.mla_behind_lens_mm))],
    ["image_depth_mm", "Image depth", value((d) => mm(d.image_depth_mm))],
    [
      "s_near_mm",
      "Shown",
      value((d) => (d.s_near_mm === null ? "–" : `${depth(d.s_far_mm)} to ${depth(d.s_near_mm)} mm`)),
    ],
    ["viewing_angle_deg", "Viewing angle", value((d) => `${quantity(d.viewing_angle_deg)}°`)],
    ["viewing_zone_mm", "Viewing zone", value((d) => mm(d.viewing_zone_mm))],
    ["width_mm", "Size", value((d) => `${quantity(d.width_mm)} × ${quantity(d.height_mm)} mm`)],
    ["gap_real_physical_mm", "Gap, real", value((d) => mm(d.gap_real_physical_mm))],
    ["gap_virtual_physical_mm", "Gap, virtual", value((d) => mm(d.gap_virtual_physical_mm))],
    ["memory_mb", "Memory", value((d) => bytes(d.memory_mb * 1e6))],
    ["frame_cpu_s", "CPU a frame", value((d) => `about ${duration(d.frame_cpu_s)}`)],
    ["cpu_s", "CPU in all", value((d) => `about ${duration(d.cpu_s)}`)],
  ];
}
