// Small pictures of all frames in a row, of which only those that can be seen are in the page. It is one stop of the
// Tab key; the arrow keys lead to the next frame that is done.
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { html } from "../../shared/html.js";
import { visibleRows } from "../../shared/windowing.js";
import { placeByKey, scrolledTo } from "./strip.js";

const STEP_PX = 62; // The width of a picture and of the gap after it, as in film_strip.css.

// `frames` is what `useFrames` returns, and `places` the places around the frame that is shown.
export function FilmStrip({ frames, frame, places, show }) {
  const { all, numbers } = frames;
  const total = all.numbers.length;
  const column = all.numbers.indexOf(frame);
  const box = useRef(null);
  const [first, end] = useColumns(box, total, column);
  const choose = (number) => frames.openStatus(number) || show(numbers.indexOf(number));
  const key = (event) => {
    const place = placeByKey(event.key, places, numbers.length);
    if (place === null) return;
    event.preventDefault();
    event.stopPropagation(); // The arrow keys turn the scene elsewhere.
    show(place);
  };
  const isOutside = column >= 0 && (column < first || column >= end);
  const columns = Array.from({ length: end - first }, (_, at) => first + at).concat(isOutside ? [column] : []);
  const list = total > 0 && {
    role: "listbox",
    "aria-label": "All frames",
    "aria-orientation": "horizontal",
    "aria-activedescendant": column < 0 ? undefined : `shot-${frame}`,
    tabindex: 0,
    onKeyDown: key,
  };
  return html`
    <div ref=${box} class="strip" ...${list}>
      <div class="film" role="presentation" style=${{ width: `${total * STEP_PX}px` }}>
        ${columns.map(
          (at) => html`
            <${Shot}
              key=${all.numbers[at]}
              at=${at}
              total=${total}
              number=${all.numbers[at]}
              status=${frames.openStatus(all.numbers[at]) || "done"}
              isShown=${at === column}
              urlOf=${(number) => frames.itemOf(number).thumbUrl}
              choose=${choose}
            />
          `,
        )}
      </div>
    </div>
  `;
}

function Shot({ at, total, number, status, isShown, urlOf, choose }) {
  const isDone = status === "done";
  const words = isDone ? `Frame ${number}` : `Frame ${number}, ${status}`;
  return html`
    <div
      id="shot-${number}"
      class="shot ${status}"
      role="option"
      aria-label=${words}
      aria-selected=${isShown}
      aria-disabled=${!isDone}
      aria-posinset=${at + 1}
      aria-setsize=${total}
      title=${words}
      style=${{ left: `${at * STEP_PX}px` }}
      onClick=${() => choose(number)}
    >
      ${isDone && html`<img src=${urlOf(number)} alt="" decoding="async" draggable=${false} />`}
    </div>
  `;
}

// The columns that are drawn: the first, and the one after the last. The strip follows the frame that is shown.
function useColumns(box, total, column) {
  const [columns, setColumns] = useState([0, 0]);
  const look = () => {
    const { scrollLeft, clientWidth } = box.current;
    const next = visibleRows(scrollLeft, clientWidth, STEP_PX, total);
    setColumns((before) => (before.join() === next.join() ? before : next));
  };
  const follow = () => {
    const { scrollLeft, clientWidth } = box.current;
    if (column >= 0) box.current.scrollLeft = scrolledTo(column, scrollLeft, clientWidth, STEP_PX);
    look();
  };
  useLayoutEffect(follow, [column, total]);
  useLayoutEffect(() => {
    const resized = new ResizeObserver(follow);
    resized.observe(box.current);
    box.current.addEventListener("scroll", look);
    const node = box.current;
    return () => {
      resized.disconnect();
      node.removeEventListener("scroll", look);
    };
  }, [column, total]);
  return columns;
}
