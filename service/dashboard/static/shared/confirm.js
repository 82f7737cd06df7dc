// A question before something that cannot be undone.
import { useEffect, useRef } from "preact/hooks";
import { html } from "./html.js";

// `answer(isYes)` is called once; the dialog is open as long as it is drawn.
export function Confirm({ title, yes, no, answer, children }) {
  const dialog = useRef(null);
  useEffect(() => {
    dialog.current.showModal();
  }, []);
  return html`
    <dialog ref=${dialog} class="ask" aria-labelledby="confirm-title"
      onClose=${(event) => answer(event.target.returnValue === "yes")}>
      <form method="dialog">
        <h2 id="confirm-title">${title}</h2>
        ${children}
        <p class="choices">
          <button value="no" autofocus>${no}</button>
          <button value="yes" class="danger">${yes}</button>
        </p>
      </form>
    </dialog>
  `;
}
