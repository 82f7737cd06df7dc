// The owners by whom the list of jobs is filtered.
import { useEffect, useState } from "preact/hooks";
import { getFarmOwners } from "../../api/operations.js";
import { html } from "../../shared/html.js";
import { useKnown } from "../../state/store.js";
import { ownersOf } from "./list_query.js";

export function OwnerFilter({ owner, choose }) {
  const jobs = useKnown((known) => known.jobs);
  const mine = useKnown((known) => known.session)?.owner_id;
  const [listed, setListed] = useState([]);
  // Without an answer the owners of the rows that are loaded remain.
  const load = () => {
    getFarmOwners().then(
      ({ items }) => setListed(items),
      () => {},
    );
  };
  useEffect(load, []);
  return html`
    <select aria-label="Owner" value=${owner} onFocus=${load} onChange=${(event) => choose(event.target.value)}>
      <option value="">All owners</option>
      ${mine && html`<option value=${mine}>My jobs</option>`}
      ${ownersOf(listed, Object.values(jobs), { mine, asked: owner }).map(
        (name) => html`<option key=${name} value=${name}>${name}</option>`,
      )}
    </select>
  `;
}
