// The keys and the browser sessions of the farm, for admins. The secret of a new key is shown once.
import { useEffect, useState } from "preact/hooks";
import { getKeys, getSessions, getWorkerKeys, postKey } from "../api/operations.js";
import { Field, numberOr } from "../new-job/form/field.js";
import { Confirm } from "../shared/confirm.js";
import { html } from "../shared/html.js";
import { useKnown } from "../state/store.js";
import { KeyTable, SessionTable, WorkerKeyTable } from "./key_tables.js";
import { OnlyAdmins, Tabs } from "./tabs.js";

const EMPTY = { name: "", role: "submitter", owner_id: "", expires_in_days: "" };
const ROLES = ["viewer", "submitter", "admin"];

export function Keys() {
  const role = useKnown((known) => known.session?.role);
  useEffect(() => {
    document.title = "Keys – Lippmann";
  }, []);
  return html`
    <article class="access">
      <a class="back" href="#/">← All jobs</a>
      <h1>Keys</h1>
      <${Tabs} here="keys" />
      ${role && role !== "admin" && html`<${OnlyAdmins} what="the keys" />`}
      ${role === "admin" && html`<${All} />`}
    </article>
  `;
}

function All() {
  const [known, setKnown] = useState({ keys: null, workerKeys: null, sessions: null });
  const [fault, setFault] = useState("");
  const [made, setMade] = useState(null);
  const [ending, setEnding] = useState(null); // what the dialog asks about: {text, more, button, run}
  const load = async () => {
    try {
      const [keys, workerKeys, sessions] = await Promise.all([getKeys(), getWorkerKeys(), getSessions()]);
      setKnown({ keys: keys.items, workerKeys: workerKeys.items, sessions: sessions.items });
      setFault("");
    } catch (error) {
      setFault(error.message);
    }
  };
  useEffect(() => {
    load();
  }, []);
  const answer = async (isYes) => {
    const chosen = ending;
    setEnding(null);
    if (!isYes) return;
    try {
      await chosen.run();
      await load();
    } catch (error) {
      setFault(error.message);
    }
  };
  return html`
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${made && html`<${Secret} made=${made} close=${() => setMade(null)} />`}
      <${NewKey} done=${(key) => {
        setMade(key);
        load();
      }} />
      <${KeyTable} keys=${known.keys} ask=${setEnding} />
      <${WorkerKeyTable} keys=${known.workerKeys} ask=${setEnding} />
      <${SessionTable} sessions=${known.sessions} ask=${setEnding} />
      ${
        ending &&
        html`
        <${Confirm} title=${ending.text} yes=${ending.button} no="Keep it" answer=${answer}>
          <p>${ending.more}</p>
        <//>
      `
      }
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
