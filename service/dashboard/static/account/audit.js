// The audit log, for admins: who changed what, when, and from where. The address has the filter.
import { useEffect, useRef, useState } from "preact/hooks";
import { getAudit } from "../api/operations.js";
import { write } from "../shared/address.js";
import { exactTime } from "../shared/format.js";
import { html } from "../shared/html.js";
import { useKnown } from "../state/store.js";
import { ACTIONS, actionWords, filterOf, pageOf } from "./audit_words.js";
import { OnlyAdmins, Tabs } from "./tabs.js";

const PAUSE_MS = 300; // While somebody types.

export function Audit({ query }) {
  const role = useKnown((known) => known.session?.role);
  useEffect(() => {
    document.title = "Audit log – Lippmann";
  }, []);
  return html`
    <article class="access">
      <a class="back" href="#/">← All jobs</a>
      <h1>Audit log</h1>
      <${Tabs} here="audit" />
      ${role && role !== "admin" && html`<${OnlyAdmins} what="the audit log" />`}
      ${role === "admin" && html`<${Log} query=${query} />`}
    </article>
  `;
}

function Log({ query }) {
  const filter = filterOf(query);
  const asked = JSON.stringify(filter);
  const [page, setPage] = useState({ items: null, next_cursor: null });
  const [fault, setFault] = useState("");
  const latest = useRef(asked);
  latest.current = asked;
  const load = async (cursor) => {
    try {
      const found = await getAudit(filter, cursor);
      if (latest.current !== asked) return; // Another filter was chosen in the meantime.
      setPage((before) => ({ ...found, items: cursor ? [...before.items, ...found.items] : found.items }));
      setFault("");
    } catch (error) {
      setFault(error.message);
    }
  };
  useEffect(() => {
    load();
  }, [asked]);
  return html`
    <${Filter} filter=${filter} />
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
    ${!page.items && !fault && html`<p class="quiet">Loading …</p>`}
    ${page.items && html`<${Entries} items=${page.items} isFiltered=${asked !== "{}"} />`}
    ${page.next_cursor && html`<p><button onClick=${() => load(page.next_cursor)}>Show older entries</button></p>`}
  `;
}

function Filter({ filter }) {
  const timer = useRef(null);
  const set = (name) => (event) => {
    const value = event.target.value.trim();
    clearTimeout(timer.current);
    timer.current = setTimeout(() => write({ [name]: value || null }), event.type === "input" ? PAUSE_MS : 0);
  };
  useEffect(() => () => clearTimeout(timer.current), []);
  return html`
    <form class="filter" aria-label="Filter" onSubmit=${(event) => event.preventDefault()}>
      <p class="field">
        <label for="f-action">Action</label>
        <select id="f-action" value=${filter.action || ""} onChange=${set("action")}>
          <option value="">all</option>
          ${ACTIONS.map((action) => html`<option key=${action} value=${action}>${actionWords(action)}</option>`)}
        </select>
      </p>
      <p class="field">
        <label for="f-by">Key</label>
        <input id="f-by" defaultValue=${filter.name || ""} placeholder="its name or id" autocomplete="off"
          onInput=${set("name")} />
      </p>
      <p class="field">
        <label for="f-subject">Subject</label>
        <input id="f-subject" defaultValue=${filter.subject || ""} placeholder="a job, scene, key or worker"
          autocomplete="off" onInput=${set("subject")} />
      </p>
    </form>
  `;
}

function Entries({ items, isFiltered }) {
  if (!items.length) {
    const words = isFiltered ? "No entry fits the filter." : "Nothing was changed yet.";
    return html`<p class="empty" role="status">${words}</p>`;
  }
  return html`
    <div class="table" role="region" aria-label="Audit log" tabindex="0"><table>
      <caption class="unseen">Audit log</caption>
      <thead><tr>
        <th scope="col">Time</th><th scope="col">Who</th><th scope="col">Action</th><th scope="col">Subject</th>
        <th scope="col">Detail</th><th scope="col">From</th>
      </tr></thead>
      <tbody>${items.map((entry) => html`<${Entry} key=${entry.id} entry=${entry} />`)}</tbody>
    </table></div>
  `;
}

function Entry({ entry }) {
  const page = pageOf(entry);
  return html`
    <tr>
      <td class="time"><time datetime=${entry.at}>${exactTime(entry.at)}</time></td>
      <td title=${`key ${entry.key_id}`}>${entry.name} <span class="quiet">${entry.role}</span></td>
      <td>${actionWords(entry.action)}</td>
      <td>${page ? html`<a href=${page}>${entry.subject}</a>` : entry.subject}</td>
      <td>${entry.detail}</td>
      <td class="quiet" title=${`request ${entry.request_id}`}>${entry.address}</td>
    </tr>
  `;
}
