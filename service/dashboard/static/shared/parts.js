// Small pieces of a page: a time, a status, a bar of progress, a button that loads more.
import { useState } from "preact/hooks";
import { useKnown } from "../state/store.js";
import { ago, exactTime, jobName, percent } from "./format.js";
import { html } from "./html.js";

export function Ago({ time }) {
  const now_ms = useKnown((known) => known.now_ms);
  return html`<time datetime=${time} title=${exactTime(time)}>${ago(time, now_ms)}</time>`;
}

export const Badge = ({ status }) => html`<span class="badge ${status}">${status}</span>`;

export function Bar({ job }) {
  const label = `${jobName(job)}: ${percent(job.progress)} done`;
  return html`<progress class=${job.status} max="1" value=${job.progress} aria-label=${label}></progress>`;
}

// A button that loads the next page, once at a time, and shows the error if that fails.
export function More({ what, load }) {
  const [state, setState] = useState("ready");
  const go = async () => {
    setState("loading");
    try {
      await load();
      setState("ready");
    } catch (error) {
      setState(error.message);
    }
  };
  return html`
    <p class="more">
      <button onClick=${go} disabled=${state === "loading"}>Show ${what}</button>
      ${!["ready", "loading"].includes(state) && html`<span class="fault" role="alert">${state}</span>`}
    </p>
  `;
}
