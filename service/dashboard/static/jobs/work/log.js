// The log of an attempt, which grows while the attempt runs.
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { getLog, getTask, link } from "../../api/operations.js";
import { html } from "../../shared/html.js";
import { place } from "../failures.js";

const RENEW_MS = 2000;
const MOST_CHARS = 200_000; // A longer log is shown from its end.
const OPEN = ["dispatched", "running"];

export function Log({ job, task, close }) {
  const [now, setNow] = useState(task);
  const [attempt, setAttempt] = useState(task.attempt_number);
  const [text, setText] = useState(null);
  const [fault, setFault] = useState("");
  const box = useRef(null);
  const isAtEnd = useRef(true);
  const isLive = OPEN.includes(now.status) && attempt === now.attempt_number;
  useEffect(() => {
    let isOver = false;
    const put = (act) => (value) => isOver || act(value);
    const load = () => {
      getTask(job.id, task.id).then(put(setNow), () => {});
      const fail = (error) => (error.status === 404 ? setText("") : setFault(error.message));
      getLog(job.id, task.id, attempt).then(
        put((found) => (setText(found), setFault(""))),
        put(fail),
      );
    };
    load();
    const timer = isLive && setInterval(load, RENEW_MS);
    return () => {
      isOver = true;
      clearInterval(timer);
    };
  }, [task.id, attempt, isLive]);
  useLayoutEffect(() => {
    if (isAtEnd.current && box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [text]);
  const follow = ({ target }) => (isAtEnd.current = target.scrollTop + target.clientHeight > target.scrollHeight - 20);
  const choose = (event) => setAttempt(Number(event.target.value));
  const numbers = Array.from({ length: now.attempt_number }, (_, index) => index + 1);
  const part = text && text.length > MOST_CHARS ? `…${text.slice(-MOST_CHARS)}` : text;
  return html`
    <section class="log" aria-label="Log of ${place(task)}">
      <h3>
        Log of ${place(task)}
        ${
          numbers.length > 1 &&
          html`<select aria-label="Attempt" value=${attempt} onChange=${choose}>
            ${numbers.map((number) => html`<option key=${number} value=${number}>attempt ${number}</option>`)}
          </select>`
        }
        ${isLive && html`<span class="badge running">live</span>`}
        <a href="${link(task.log_url)}?attempt=${attempt}" target="_blank">Whole log</a>
        <button class="plain" onClick=${close}>Close</button>
      </h3>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      <pre ref=${box} tabindex="0" onScroll=${follow}>${part || (text === null ? "Loading …" : "No log yet.")}</pre>
    </section>
  `;
}
