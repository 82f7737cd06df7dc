// The keys and the browser sessions of the farm, for admins. The secret of a new key is shown once.
import { useEffect, useRef, useState } from "preact/hooks";
import { deleteKey, deleteSession, getKeys, getSessions, postKey } from "../api/operations.js";
import { Field, numberOr } from "../new-job/field.js";
import { exactTime } from "../shared/format.js";
import { html } from "../shared/html.js";
import { Ago } from "../shared/parts.js";
import { useKnown } from "../state/store.js";

const EMPTY = { name: "", role: "submitter", owner_id: "", expires_in_days: "" };
const ROLES = ["viewer", "submitter", "admin"];

export function Keys() {
  const [known, setKnown] = useState({ keys: null, sessions: null });
  const [fault, setFault] = useState("");
  const [made, setMade] = useState(null);
  const [ending, setEnding] = useState(null); // what the dialog asks about: {text, button, run}
  const dialog = useRef(null);
  const load = async () => {
    try {
      const [keys, sessions] = await Promise.all([getKeys(), getSessions()]);
      setKnown({ keys: keys.items, sessions: sessions.items });
      setFault("");
    } catch (error) {
      setFault(error.message);
    }
  };
  useEffect(() => {
    document.title = "Keys – Lippmann";
    load();
  }, []);
  const ask = (question) => {
    setEnding(question);
    dialog.current.showModal();
  };
  const answer = async (event) => {
    if (event.target.returnValue !== "yes") return;
    try {
      await ending.run();
      await load();
    } catch (error) {
      setFault(error.message);
    }
  };
  return html`
    <article class="access">
      <a class="back" href="#/">← All jobs</a>
      <h1>Keys</h1>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${made && html`<${Secret} made=${made} close=${() => setMade(null)} />`}
      <${NewKey} done=${(key) => {
        setMade(key);
        load();
      }} />
      <${KeyTable} keys=${known.keys} ask=${ask} />
      <${SessionTable} sessions=${known.sessions} ask=${ask} />
      <dialog ref=${dialog} class="ask" aria-labelledby="end-title" onClose=${answer}>
        <form method="dialog">
          <h2 id="end-title">${ending?.text}</h2>
          <p>Event streams end at once. Jobs go on.</p>
          <p class="choices">
            <button value="no" autofocus>Keep it</button>
            <button value="yes" class="danger">${ending?.button}</button>
          </p>
        </form>
      </dialog>
    </article>
  `;
}

function Secret({ made, close }) {
  return html`
    <section class="secret" role="status" aria-label="New key">
      <p>The key ${made.name} is made. It is not shown again:</p>
      <p><code>${made.key}</code></p>
      <p class="choices"><button onClick=${close}>I have it</button></p>
    </section>
  `;
}

function NewKey({ done }) {
  const [values, setValues] = useState(EMPTY);
  const [problem, setProblem] = useState(null);
  const [busy, setBusy] = useState(false);
  const set = (name) => (event) => setValues({ ...values, [name]: event.target.value });
  const faultsOf = (name) =>
    (problem?.fields || [])
      .filter(({ field }) => field === name)
      .map(({ expected, got }) => `expected ${expected}, got ${got}`);
  const submit = async (event) => {
    event.preventDefault();
    setBusy(true);
    setProblem(null);
    try {
      const { name, role, owner_id, expires_in_days } = values;
      done(
        await postKey({
          name,
          role,
          owner_id: owner_id || null,
          expires_in_days: expires_in_days ? numberOr(expires_in_days) : null,
        }),
      );
      setValues(EMPTY);
    } catch (error) {
      setProblem(error);
    }
    setBusy(false);
  };
  const input = (name, label, more = {}) => html`
    <${Field} name=${name} label=${label} value=${values[name]} onInput=${set(name)} faults=${faultsOf(name)}
      ...${more} />
  `;
  return html`
    <form class="new-key" onSubmit=${submit} noValidate aria-label="New key">
      ${input("name", "Name")}
      <p class="field">
        <label for="f-role">Role</label>
        <select id="f-role" value=${values.role} onChange=${set("role")}>
          ${ROLES.map((role) => html`<option value=${role}>${role}</option>`)}
        </select>
      </p>
      ${input("owner_id", "Owner", { hint: "the key itself" })}
      ${input("expires_in_days", "Expires in", { unit: "days", hint: "never", inputmode: "decimal" })}
      <button class="primary" disabled=${busy}>Create a key</button>
      ${problem && !problem.fields?.length && html`<p class="fault" role="alert">${problem.message}</p>`}
    </form>
  `;
}

function KeyTable({ keys, ask }) {
  const now_ms = useKnown((known) => known.now_ms);
  if (!keys) return html`<p class="quiet">Loading …</p>`;
  const end = (key) =>
    ask({
      text: `Revoke the key ${key.name}?`,
      button: "Revoke the key",
      run: () => deleteKey(key.id),
    });
  return html`
    <div class="table"><table>
      <caption class="unseen">Keys</caption>
      <thead><tr><th>Name</th><th>Role</th><th>Owner</th><th>Last use</th><th>Expires</th><th></th></tr></thead>
      <tbody>
        ${keys.map(
          (key) => html`
          <tr key=${key.id}>
            <td title=${`id ${key.id}`}>${key.name}</td>
            <td>${key.role}</td>
            <td>${key.owner_id === key.id ? html`<span class="quiet">itself</span>` : key.owner_id}</td>
            <td>${key.used_at ? html`<${Ago} time=${key.used_at} />` : html`<span class="quiet">never</span>`}</td>
            <td><${Expiry} time=${key.expires_at} now_ms=${now_ms} /></td>
            <td><button aria-label=${`Revoke ${key.name}`} onClick=${() => end(key)}>Revoke</button></td>
          </tr>
        `,
        )}
      </tbody>
    </table></div>
  `;
}

function Expiry({ time, now_ms }) {
  if (!time) return html`<span class="quiet">never</span>`;
  const isOver = Date.parse(time) < now_ms;
  return html`<time class=${isOver ? "fault" : ""} datetime=${time}>${isOver ? "expired" : exactTime(time)}</time>`;
}

function SessionTable({ sessions, ask }) {
  if (!sessions) return null;
  const end = (one) =>
    ask({
      text: `End the session of ${one.name}?`,
      button: "End the session",
      run: () => deleteSession(one.id),
    });
  return html`
    <h2>Browser sessions</h2>
    <div class="table"><table>
      <caption class="unseen">Browser sessions</caption>
      <thead><tr><th>Name</th><th>Role</th><th>Owner</th><th>Last use</th><th>Expires</th><th></th></tr></thead>
      <tbody>
        ${sessions.map(
          (one) => html`
          <tr key=${one.id}>
            <td>${one.name}</td>
            <td>${one.role}</td>
            <td>${one.owner_id}</td>
            <td>${one.used_at ? html`<${Ago} time=${one.used_at} />` : html`<span class="quiet">never</span>`}</td>
            <td>${exactTime(one.expires_at)}</td>
            <td><button aria-label=${`End the session of ${one.name}`} onClick=${() => end(one)}>End</button></td>
          </tr>
        `,
        )}
      </tbody>
    </table></div>
  `;
}
