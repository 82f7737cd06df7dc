// Sheet: the integral image itself, orthoscopic or as captured, or all its views, down to single cells.
import { useEffect, useState } from "preact/hooks";
import { asPng } from "../../api/operations.js";
import { Choice } from "../../shared/choice.js";
import { by } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { FIT, zoomedAt } from "../hand/zoom.js";

const SHEETS = [
  ["orthoscopic", "Orthoscopic"],
  ["integral", "Pseudoscopic"],
  ["views", "All views"],
];
const CELL_PART = 0.8; // A cell that is shown alone fills so much of the stage.

export const sheet = {
  name: "sheet",
  hint: "Drag to move the sheet. Plus and minus zoom.",
  filled: (_frameViews, stand) => stand,
  said: ({ stand, size }) =>
    size ? `${SHEETS.find(([kind]) => kind === stand.sheet)[1]}, ${by(size.width, size.height)} px` : "",
  Picture,
  Controls: ({ frameViews, stand, change, size, room }) => html`
    <${Choice} name="Sheet" choices=${SHEETS} chosen=${stand.sheet} choose=${(sheet) => change({ sheet, zoom: FIT })} />
    ${
      size &&
      frameViews &&
      stand.sheet !== "views" &&
      html`<button onClick=${() => change({ zoom: oneCell(stand.zoom, frameViews, size, room) })}>One cell</button>`
    }
  `,
};

// A zoom at which the cell in the middle fills the stage.
function oneCell(zoom, { lens_rows, lens_cols }, size, room) {
  const cell = { width: size.width / Math.max(1, lens_cols), height: size.height / Math.max(1, lens_rows) };
  const fit = Math.min(room.width / size.width, room.height / size.height);
  const side = Math.max(cell.width, cell.height);
  const scale = (CELL_PART * Math.min(room.width, room.height)) / (side * fit);
  const centred = {
    ...zoom,
    x: (Math.floor(zoom.x * lens_cols) + 0.5) / lens_cols,
    y: (Math.floor(zoom.y * lens_rows) + 0.5) / lens_rows,
  };
  const middle = { x: room.width / 2, y: room.height / 2 };
  return zoomedAt(centred, scale / zoom.scale, middle, size, room);
}

// `onSize` is called with the size of the picture in px.
function Picture({ item, stand, label, styleOf, onSize, busy }) {
  const [state, setState] = useState("loading");
  const [size, setSize] = useState(null);
  const url = item?.[stand.sheet] && asPng(item[stand.sheet]);
  busy.current = state === "loading";
  useEffect(() => setState("loading"), [url]);
  const loaded = ({ target }) => {
    const found = { width: target.naturalWidth, height: target.naturalHeight };
    setState("ready");
    setSize(found);
    onSize(found);
  };
  return html`
    ${
      url &&
      html`
        <img
          key=${stand.sheet}
          class="pixels ${state}"
          src=${url}
          alt=${label}
          style=${size ? styleOf(size) : {}}
          onLoad=${loaded}
          onError=${() => setState("broken")}
          draggable=${false}
        />
      `
    }
    ${state === "broken" && html`<p class="fault" role="alert">This picture cannot be shown.</p>`}
  `;
}
