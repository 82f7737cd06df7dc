// The frames of a job: all of them by status, and their pictures in pages.
import { useEffect, useState } from "preact/hooks";
import { link } from "../../api/operations.js";
import { write } from "../../shared/address.js";
import { count } from "../../shared/format.js";
import { FRAMES_A_PAGE, loadMoreFrames, openFrames } from "../../state/frame_pages.js";
import { html } from "../../shared/html.js";
import { FrameGrid } from "./frame_grid.js";
import { More } from "../../shared/parts.js";
import { useKnown } from "../../state/store.js";

// The room of a frame that is not loaded yet.
const place = (_, at) => html`
  <li key=${`place ${at}`} class="cell waiting"><span class="lattice" aria-hidden="true"></span></li>
`;

export function Frames({ job }) {
  const frames = useKnown((known) => known.frames);
  const [fault, setFault] = useState("");
  useEffect(() => {
    openFrames(job.id).catch((error) => setFault(error.message));
  }, [job.id]);
  const isOpen = ["probing", "running"].includes(job.status);
  const items = frames?.job === job.id ? frames.pages.flatMap((page) => page.items) : [];
  return html`
    <section class="frames ${isOpen ? "open" : "still"}" aria-label="Frames">
      <h2>Frames <span class="quiet">${count(job.frames_done)} of ${count(job.frames_total)}</span></h2>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      <${FrameGrid} job=${job} />
      <ol class="pictures">
        ${Array.from({ length: items.length ? 0 : Math.min(job.frames_total, FRAMES_A_PAGE) }, place)}
        ${items.map((item) => html`<${Cell} key=${item.frame} item=${item} isOpen=${isOpen} show=${showLarge} />`)}
      </ol>
      ${frames?.cursor && items.length > 0 && html`<${More} what="more frames" load=${loadMoreFrames} />`}
    </section>
  `;
}

// The viewer above shows the frame of the address.
function showLarge(frame) {
  write({ frame }, { replace: false });
  document.querySelector(".looker")?.scrollIntoView({ block: "nearest" });
}

function Cell({ item, isOpen, show }) {
  const { frame, status, thumb } = item;
  const word = status === "rendering" && !isOpen ? "begun" : status;
  if (status === "done" && thumb) {
    return html`
      <li class="cell done">
        <button onClick=${() => show(frame)} aria-label="Frame ${frame}, show large">
          <img src=${link(thumb)} alt="" loading="lazy" decoding="async" onLoad=${reveal} />
          <span class="number">${frame}</span>
        </button>
      </li>
    `;
  }
  return html`
    <li class="cell ${status}" title=${word}>
      <span class="lattice" aria-hidden="true"></span>
      <span class="number">${frame}</span><span class="unseen">, ${word}</span>
    </li>
  `;
}

const reveal = (event) => event.target.classList.add("here");
