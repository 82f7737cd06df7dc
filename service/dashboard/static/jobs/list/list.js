// The list of jobs: a window on all jobs that the filters find.
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { count as number, many } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { useAddress } from "../../shared/use_address.js";
import { holdList, openList, renewList, showRows } from "../../state/job_list.js";
import { mayChange, maySubmit, useKnown } from "../../state/store.js";
import { Filters } from "./filters.js";
import { hrefOf, isFiltered, parseQuery } from "./list_query.js";
import { isInOrderOfWork, useReorder } from "./reorder.js";
import { Row } from "./row.js";
import { Several } from "./several.js";
import { between, visibleRows } from "../../shared/windowing.js";

const ROW_PX = 78; // as in jobs/list.css
const HOW = "Drag a handle, or use Alt with ↑ and ↓.";

// `isMain` is true where the list is all that the page shows.
export function JobList({ open, isMain }) {
  const rows = useRef(null);
  const query = useQuery(rows);
  const list = useKnown((known) => known.list);
  const jobs = useKnown((known) => known.jobs);
  const session = useKnown((known) => known.session);
  const canSelect = useKnown(maySubmit);
  const hold = useHold(rows);
  const [first, end] = useWindow(rows, list.total, hold.scrolled);
  const places = useReorder(rows, query, ROW_PX);
  const [picked, setPicked] = useState(new Map()); // jobs by id
  const last = useRef(null); // the row that was selected last
  const turn = (row) => (event) => {
    const isOn = event.target.checked;
    const ids = event.shiftKey && last.current !== null ? between(list.ids, last.current, row) : [list.ids[row]];
    const after = new Map(picked);
    const allowed = ids.filter((id) => jobs[id] && mayChange({ session }, jobs[id]));
    allowed.forEach((id) => (isOn ? after.set(id, jobs[id]) : after.delete(id)));
    last.current = row;
    setPicked(after);
  };
  const shown = [];
  for (let row = first; row < end; row++) {
    const id = list.ids[row];
    const job = jobs[id];
    const canTick = job && canSelect && mayChange({ session }, job);
    shown.push(html`
      <li key=${row} style=${{ transform: `translateY(${row * ROW_PX}px)` }} aria-setsize=${list.total}
        aria-posinset=${row + 1} class=${placeClass(places.drag, row)}>
        ${job && places.handleOf(row, job)}
        ${
          job &&
          html`<${Row} job=${job} href=${hrefOf(id, query)} isOpen=${id === open}
          tick=${canTick && { isOn: picked.has(id), turn: turn(row) }} />`
        }
        ${!job && html`<p class="gone quiet">${id ? "This job was removed." : "Loading …"}</p>`}
      </li>
    `);
  }
  const isHeld = hold.isHeld && list.isStale;
  return html`
    <div class="jobs" role=${isMain ? "main" : "navigation"} aria-label="Jobs">
      <${isMain ? "h1" : "h2"}>Jobs ${list.isLoaded && html`<span class="quiet">${number(list.total)}</span>`}<//>
      <${Filters} query=${query} />
      ${picked.size > 0 && html`<${Several} picked=${picked} setPicked=${setPicked} />`}
      <p class="changed" role="status">
        ${isHeld && html`The list has changed. <button onClick=${() => renewList({ force: true })}>Update</button>`}
        ${list.fault && html`<span class="fault">${list.fault}</span>`}
      </p>
      ${isInOrderOfWork(query) && html`<p class="places quiet" role="status">${places.words || (canSelect && HOW)}</p>`}
      ${places.question}
      ${list.isLoaded && list.total === 0 && html`<${Empty} query=${query} canSubmit=${canSelect} />`}
      <ol ref=${rows} style=${{ height: `${list.total * ROW_PX}px` }} ...${hold.listeners}>${shown}</ol>
      <p class="unseen" role="status">${list.isLoaded && isFiltered(query) && `${many(list.total, "job")} found`}</p>
    </div>
  `;
}

// The row that is dragged, and the edge of the row beside which it would go.
function placeClass(drag, row) {
  if (!drag) return null;
  if (row === drag.row) return "dragged";
  if (row !== drag.to) return null;
  return drag.to < drag.row ? "before" : "behind";
}

function Empty({ query, canSubmit }) {
  if (isFiltered(query)) return html`<p class="quiet">No job matches these filters.</p>`;
  return html`<p class="quiet">No jobs yet. ${canSubmit && html`<a href="#/new">Submit the first one.</a>`}</p>`;
}

// The query of the address; pages that say nothing of the list leave it as it is.
function useQuery(rows) {
  const here = useAddress();
  const kept = useRef(null);
  if (!kept.current || ["list", "job"].includes(here.view)) kept.current = parseQuery(here.query);
  const text = JSON.stringify(kept.current);
  const isFirst = useRef(true);
  useEffect(() => {
    // What is typed is searched for after a pause.
    const open = () => {
      rows.current.closest(".jobs").scrollTop = 0;
      openList(JSON.parse(text));
    };
    const timer = setTimeout(open, isFirst.current ? 0 : 200);
    isFirst.current = false;
    return () => clearTimeout(timer);
  }, [text]);
  return kept.current;
}

// The rows that are drawn. The list scrolls by itself on a wide screen, and with the page on a narrow one.
function useWindow(rows, total, scrolled) {
  const [range, setRange] = useState([0, 0]);
  useLayoutEffect(() => {
    let frame = 0;
    const measure = () => {
      frame = 0;
      if (!rows.current) return;
      const above_px = -rows.current.getBoundingClientRect().top;
      const [first, end] = visibleRows(above_px, innerHeight, ROW_PX, total);
      setRange((before) => (before[0] === first && before[1] === end ? before : [first, end]));
      showRows(first, end);
      scrolled(above_px > innerHeight / 2);
    };
    const soon = () => (frame ||= requestAnimationFrame(measure));
    measure();
    document.addEventListener("scroll", soon, { capture: true, passive: true });
    addEventListener("resize", soon);
    return () => {
      document.removeEventListener("scroll", soon, { capture: true });
      removeEventListener("resize", soon);
      cancelAnimationFrame(frame);
    };
  }, [total]);
  return [Math.min(range[0], total), Math.min(Math.max(range[1], 0), total)];
}

// Whether the user holds the list: by the pointer, by the keyboard, or because it is scrolled down.
function useHold(rows) {
  const [by, setBy] = useState({ pointer: false, keys: false, scroll: false });
  const isHeld = by.pointer || by.keys || by.scroll;
  useEffect(() => holdList(isHeld), [isHeld]);
  const put = (patch) =>
    setBy((before) =>
      Object.keys(patch).every((key) => before[key] === patch[key]) ? before : { ...before, ...patch },
    );
  return {
    isHeld,
    scrolled: (scroll) => put({ scroll }),
    listeners: {
      onPointerEnter: () => put({ pointer: true }),
      onPointerLeave: () => put({ pointer: false }),
      onFocusIn: () => put({ keys: rows.current?.querySelector(":focus-visible") !== null }),
      onFocusOut: () => put({ keys: false }),
    },
  };
}
