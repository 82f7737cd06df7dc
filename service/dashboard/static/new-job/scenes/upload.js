// The upload of a scene: a folder or a zip, dropped or chosen.
import { useRef, useState } from "preact/hooks";
import { postScene } from "../../api/operations.js";
import { bytes } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { bundleOf } from "./dropped.js";

const HINT = "Drop a folder or a zip with a scene.toml here, or choose";

export function Upload({ isAllowed, add }) {
  const [said, setSaid] = useState({ text: "", isFault: false });
  const [isOver, setOver] = useState(false);
  const zip = useRef(null);
  const folder = useRef(null);
  const send = async (transfer) => {
    let size = 0;
    try {
      const { name, bundle } = await bundleOf(transfer);
      size = bundle.size;
      setSaid({ text: `Uploading ${name}, ${bytes(size)} …`, isFault: false });
      const scene = await postScene(name, bundle);
      setSaid({ text: [`${scene.title} is uploaded as ${scene.name}.`, ...scene.notes].join(" "), isFault: false });
      add(scene);
    } catch (error) {
      setSaid({ text: reasonOf(error, size), isFault: true });
    }
  };
  const drop = (event) => {
    event.preventDefault();
    setOver(false);
    send(event.dataTransfer);
  };
  const over = (event) => {
    event.preventDefault();
    setOver(true);
  };
  const chosen = (event) => {
    if (event.target.files.length) send({ files: [...event.target.files] });
    event.target.value = ""; // The same file may be chosen again after a correction.
  };
  if (!isAllowed) return null;
  return html`
    <div class="upload ${isOver ? "over" : ""}" onDragOver=${over} onDragLeave=${() => setOver(false)} onDrop=${drop}>
      <p>
        <span class="quiet">${HINT}</span>
        <button type="button" onClick=${() => zip.current.click()}>a zip</button>
        <button type="button" onClick=${() => folder.current.click()}>a folder</button>
      </p>
      <input ref=${zip} type="file" accept=".zip" hidden onChange=${chosen} aria-label="A zip with a scene" />
      <input ref=${folder} type="file" webkitdirectory hidden onChange=${chosen} aria-label="A folder with a scene" />
      <p class=${said.isFault ? "fault" : "help"} role="status">${said.text}</p>
    </div>
  `;
}

// A service that refuses a large body may end the connection before it is sent.
function reasonOf(error, size) {
  const isCut = size > 0 && error.status === undefined;
  return isCut ? `${error.message} The upload of ${bytes(size)} was cut; it may be too large.` : error.message;
}
