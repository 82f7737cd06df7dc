// A question before something that cannot be undone.
import { useEffect, useRef } from "preact/hooks";
import { html } from "../shared/html.js";

// `question` is null, or {title, text, button, run}. `close(didRun)` is called with the answer.
export function Ask({ question, close }) {
  const dialog = useRef(null);
  useEffect(() => {
    if (question) dialog.current.showModal();
  }, [question]);
  return html`
    <dialog ref=${dialog} class="ask" aria-labelledby="ask-title"
      onClose=${(event) => close(event.target.returnValue === "yes" ? question : null)}>
      <form method="dialog">
        <h2 id="ask-title">${question?.title}</h2>
        <p>${question?.text}</p>
        <p class="choices">
          <button value="no" autofocus>Leave it</button>
          <button value="yes" class="danger">${question?.button}</button>
        </p>
      </form>
    </dialog>
  `;
}
