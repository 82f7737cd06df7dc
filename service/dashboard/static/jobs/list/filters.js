// The search, the filters and the order of the list of jobs; all of them are in the address.
import { html } from "../../shared/html.js";
import { write } from "../../shared/address.js";
import { addressOf, isFiltered, SORTS, STATUSES } from "./list_query.js";
import { OwnerFilter } from "./owners.js";

const choice = ([value, [title]]) => html`<option key=${value} value=${value}>${title}</option>`;

export function Filters({ query }) {
  const set = (patch) => write(addressOf({ ...query, ...patch }));
  return html`
    <div class="filters" role="search">
      <input type="search" aria-label="Search jobs" placeholder="Search title, scene, owner, id" maxlength="100"
        value=${query.search} onInput=${(event) => set({ search: event.target.value })} />
      <select aria-label="Status" value=${query.status} onChange=${(event) => set({ status: event.target.value })}>
        <option value="">All statuses</option>
        ${Object.entries(STATUSES).map(choice)}
      </select>
      <${OwnerFilter} owner=${query.owner} choose=${(owner) => set({ owner })} />
      <select aria-label="Sort by" value=${query.sort}
        onChange=${(event) => set({ sort: event.target.value, ascending: SORTS[event.target.value][1] })}>
        ${Object.entries(SORTS).map(choice)}
      </select>
      <p>
        <button class="direction" aria-label=${query.ascending ? "Lowest first" : "Highest first"}
          title=${query.ascending ? "Lowest first" : "Highest first"}
          onClick=${() => set({ ascending: !query.ascending })}>${query.ascending ? "↑" : "↓"}</button>
        ${
          isFiltered(query) &&
          html`<button class="plain" onClick=${() => set({ search: "", status: "", owner: "" })}>Clear filters</button>`
        }
      </p>
    </div>
  `;
}
