// The keys, the worker keys and the browser sessions as tables, each with a button that ends it.
import { useState } from "preact/hooks";
import { deleteKey, deleteSession } from "../api/operations.js";
import { exactTime } from "../shared/format.js";
import { html } from "../shared/html.js";
import { Ago } from "../shared/parts.js";
import { useKnown } from "../state/store.js";

const ROLES = ["all", "viewer", "submitter", "admin"];
const STREAMS_END = "Event streams end at once. Jobs go on.";
const WORKERS_END = "What workers with this key do counts no more, and its tasks go to others. They end by themselves.";
const never = html`<span class="quiet">never</span>`;

export function KeyTable({ keys, ask }) {
  const [role, setRole] = useState("all");
  if (!keys) return html`<p class="quiet">Loading …</p>`;
  const shown = keys.filter((key) => role === "all" || key.role === role);
  const end = (key) => ({ name: key.name, title: `Revoke the key ${key.name}?`, run: () => deleteKey(key.id) });
  return html`
    <fieldset class="roles">
      <legend class="unseen">Keys of which role</legend>
      ${ROLES.map(
        (name) => html`
        <label key=${name}>
          <input type="radio" name="of-role" checked=${name === role} onChange=${() => setRole(name)} /> ${name}
        </label>
      `,
      )}
    </fieldset>
    <${Table} title="Keys" head=${["Name", "Role", "Owner", "Made", "Last use", "Expires"]}>
      ${shown.map(
        (key) => html`
        <tr key=${key.id}>
          <td title=${`id ${key.id}`}>${key.name}</td>
          <td>${key.role}</td>
          <td>${key.owner_id === key.id ? html`<span class="quiet">itself</span>` : key.owner_id}</td>
          <td><${Ago} time=${key.created_at} /></td>
          <td>${key.used_at ? html`<${Ago} time=${key.used_at} />` : never}</td>
          <td><${Expiry} time=${key.expires_at} /></td>
          <td><${Revoke} ask=${ask} one=${end(key)} more=${STREAMS_END} /></td>
        </tr>
      `,
      )}
    <//>
    ${!shown.length && html`<p class="quiet">No key has the role ${role}. Create one above.</p>`}
  `;
}

export function WorkerKeyTable({ keys, ask }) {
  if (!keys) return null;
  const end = (key) => ({ name: key.name, title: `Revoke the worker key ${key.name}?`, run: () => deleteKey(key.id) });
  return html`
    <h2>Worker keys</h2>
    ${
      !keys.length &&
      html`
      <p class="empty">
        No other machine has a key. Make a file with which one joins the farm:${" "}
        <code>lippmann keys create HOST --worker --out HOST.toml</code>
      </p>
    `
    }
    ${
      keys.length > 0 &&
      html`
      <${Table} title="Worker keys" head=${["Name", "Made", "Last use", "Expires"]}>
        ${keys.map(
          (key) => html`
          <tr key=${key.id}>
            <td title=${`id ${key.id}`}>${key.name}</td>
            <td><${Ago} time=${key.created_at} /></td>
            <td>${key.used_at ? html`<${Ago} time=${key.used_at} />` : never}</td>
            <td><${Expiry} time=${key.expires_at} /></td>
            <td><${Revoke} ask=${ask} one=${end(key)} more=${WORKERS_END} /></td>
          </tr>
        `,
        )}
      <//>
    `
    }
  `;
}

export function SessionTable({ sessions, ask }) {
  if (!sessions) return null;
  const end = (one) => ({
    text: `End the session of ${one.name}?`,
    button: "End the session",
    more: STREAMS_END,
    run: () => deleteSession(one.id),
  });
  return html`
    <h2>Browser sessions</h2>
    <${Table} title="Browser sessions" head=${["Name", "Role", "Owner", "Last use", "Expires"]}>
      ${sessions.map(
        (one) => html`
        <tr key=${one.id}>
          <td>${one.name}</td>
          <td>${one.role}</td>
          <td>${one.owner_id}</td>
          <td>${one.used_at ? html`<${Ago} time=${one.used_at} />` : never}</td>
          <td>${exactTime(one.expires_at)}</td>
          <td><button aria-label=${`End the session of ${one.name}`} onClick=${() => ask(end(one))}>End</button></td>
        </tr>
      `,
      )}
    <//>
  `;
}

const Table = ({ title, head, children }) => html`
  <div class="table" role="region" aria-label=${title} tabindex="0"><table>
    <caption class="unseen">${title}</caption>
    <thead><tr>${head.map((text) => html`<th key=${text} scope="col">${text}</th>`)}<td></td></tr></thead>
    <tbody>${children}</tbody>
  </table></div>
`;

const Revoke = ({ ask, one, more }) => html`
  <button aria-label=${`Revoke ${one.name}`}
    onClick=${() => ask({ text: one.title, button: "Revoke the key", more, run: one.run })}>Revoke</button>
`;

function Expiry({ time }) {
  const now_ms = useKnown((known) => known.now_ms);
  if (!time) return never;
  const isOver = Date.parse(time) < now_ms;
  return html`<time class=${isOver ? "fault" : ""} datetime=${time}>${isOver ? "expired" : exactTime(time)}</time>`;
}
