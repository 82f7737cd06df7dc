// An input of one line. While somebody writes, it shows what is written; otherwise the value, or the one that counts.
import { useState } from "preact/hooks";
import { html } from "../../shared/html.js";
import { textOf } from "../job_file.js";

export function Input({ id, value, hint, isNumeric, put, ...rest }) {
  const [draft, setDraft] = useState(null);
  const write = (event) => {
    setDraft(event.target.value);
    put(event.target.value);
  };
  return html`
    <input id="f-${id}" name=${id} autocomplete="off" spellcheck=${false} inputmode=${isNumeric ? "decimal" : null}
      value=${draft ?? textOf(value ?? hint)} placeholder=${textOf(hint) || null} onInput=${write}
      onBlur=${() => setDraft(null)} ...${rest} />
  `;
}
