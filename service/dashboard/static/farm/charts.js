// The last hours of the farm as two charts. uPlot is loaded when the page of the farm is opened, and on no other page.
import { useEffect, useRef, useState } from "preact/hooks";
import { count, quantity } from "../shared/format.js";
import { html } from "../shared/html.js";
import { columns, top, totals } from "./chart_data.js";
import { useHistory } from "./use_farm.js";

const HEIGHT_PX = 150;
const SPANS = [
  { span: 1, title: "1 hour" },
  { span: 24, title: "1 day" },
  { span: 168, title: "1 week" },
];

export function Charts() {
  const [hours, setHours] = useState(24);
  const { value, fault } = useHistory(hours);
  const data = value && columns(value);
  const all = value && totals(value);
  return html`
    <section class="charts" aria-labelledby="charts-title">
      <h2 id="charts-title">The last hours</h2>
      <fieldset class="spans">
        <legend class="unseen">Time that is shown</legend>
        ${SPANS.map(
          ({ span, title }) => html`
          <label key=${span}>
            <input type="radio" name="span" checked=${span === hours} onChange=${() => setHours(span)} /> ${title}
          </label>
        `,
        )}
      </fieldset>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      <div class="pair">
        <${Chart} title="Frames an hour" times=${data?.times} values=${data?.rates}
          words=${all ? `${count(all.frames)} frames in this time` : ""} />
        <${Chart} title="Slots in use" times=${data?.times} values=${data?.slots}
          words=${all ? `${quantity(Math.round(all.slots * 100) / 100)} on average` : ""} />
      </div>
    </section>
  `;
}

function Chart({ title, times, values, words }) {
  const box = useRef(null);
  const [fault, setFault] = useState("");
  useEffect(() => {
    if (!times) return undefined;
    const element = box.current; // It is gone from the reference when the page is left.
    let plot = null;
    let isOver = false;
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const draw = async () => {
      try {
        const { default: uPlot } = await import("uplot");
        if (isOver) return;
        plot?.destroy();
        plot = new uPlot(options(title, element.clientWidth, top(values)), [times, values], element);
      } catch {
        setFault("The chart cannot be drawn.");
      }
    };
    const watch = new ResizeObserver(() => plot?.setSize({ width: element.clientWidth, height: HEIGHT_PX }));
    watch.observe(element);
    dark.addEventListener("change", draw);
    draw();
    return () => {
      isOver = true;
      watch.disconnect();
      dark.removeEventListener("change", draw);
      plot?.destroy();
    };
  }, [times?.at(-1), values?.join()]);
  return html`
    <figure>
      <figcaption>${title} <span class="quiet">${words}</span></figcaption>
      <div class="chart" ref=${box} aria-hidden="true"></div>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
    </figure>
  `;
}

// Times as people of this place write them: hours and minutes within a day, days beyond it.
function timeTexts(_plot, times) {
  const isLong = times.at(-1) - times[0] > 86_400;
  const format = new Intl.DateTimeFormat(
    undefined,
    isLong ? { weekday: "short", day: "numeric" } : { hour: "2-digit", minute: "2-digit", hourCycle: "h23" },
  );
  return times.map((time) => format.format(new Date(time * 1000)));
}

function options(title, width, most) {
  const style = getComputedStyle(document.documentElement);
  const colours = ["--soft", "--line", "--accent", "--accent-wash"].map((name) => style.getPropertyValue(name));
  const [ink, line, accent, wash] = colours;
  const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { show: false }, font: "11px system-ui" };
  return {
    width,
    height: HEIGHT_PX,
    legend: { show: false },
    cursor: { show: false },
    scales: { y: { range: [0, most] } },
    axes: [
      { ...axis, grid: { show: false }, values: timeTexts },
      { ...axis, size: 44 },
    ],
    series: [{}, { label: title, stroke: accent, width: 1.5, fill: wash, points: { show: false } }],
  };
}
