// The account: who is logged in, what the role allows, and how much of each limit is used.
import { useEffect, useState } from "preact/hooks";
import { getUsage, link } from "../api/operations.js";
import { percent } from "../shared/format.js";
import { html } from "../shared/html.js";
import { useKnown } from "../state/store.js";
import { Tabs } from "./tabs.js";
import { fullness, mayOf, usageGroups } from "./usage_words.js";

export function Account() {
  const session = useKnown((known) => known.session);
  const [usage, setUsage] = useState(null);
  const [fault, setFault] = useState("");
  useEffect(() => {
    document.title = "Your account – Lippmann";
    getUsage().then(setUsage, (error) => setFault(error.message));
  }, []);
  const isLoaded = session && usage; // Together, so that nothing moves when the other comes.
  const groups = isLoaded ? usageGroups(usage.items) : [];
  return html`
    <article class="access">
      <a class="back" href="#/">← All jobs</a>
      <h1>Your account</h1>
      <${Tabs} here="account" />
      ${
        isLoaded &&
        html`
        <dl class="traits">
          <div><dt>Name</dt><dd>${session.name}</dd></div>
          <div><dt>Role</dt><dd>${session.role}</dd></div>
          <div><dt>Owner</dt><dd>${session.owner_id}</dd></div>
        </dl>
        <p class="quiet">${mayOf(session.role)} Programs use the <a href=${link("/docs")}>API</a>; the
          ${" "}<a href=${link("/help/")}>documentation</a> explains everything, these
          ${" "}<a href=${link("/help/keys.html#limits-and-quotas")}>limits</a>, too.</p>
      `
      }
      ${fault && html`<p class="fault" role="alert">${fault} Load the page again in a moment.</p>`}
      ${!isLoaded && !fault && html`<p class="quiet">Loading …</p>`}
      ${groups.map(([title, rows]) => html`<${Group} key=${title} title=${title} rows=${rows} />`)}
    </article>
  `;
}

const Group = ({ title, rows }) => html`
  <h2>${title}</h2>
  <div class="table" role="region" aria-label=${title} tabindex="0"><table class="usage">
    <caption class="unseen">${title}</caption>
    <thead><tr>
      <th scope="col">Limit</th>${isCounted(rows) && html`<th scope="col">Used</th>`}
      <th scope="col">At most</th><th scope="col">From</th>
    </tr></thead>
    <tbody>
      ${rows.map(
        (row) => html`
        <tr key=${row.name}>
          <th scope="row">${row.title}</th>
          ${isCounted(rows) && html`<td><${Used} row=${row} /></td>`}
          <td>${row.limit}</td>
          <td class="quiet">${row.source}</td>
        </tr>
      `,
      )}
    </tbody>
  </table></div>
`;

const isCounted = (rows) => rows.some(({ used }) => used !== null);

function Used({ row }) {
  if (row.used === null) return html`<span class="quiet">not counted</span>`;
  return html`
    ${row.used} <span class="quiet">${percent(row.share)}</span>
    <progress class=${fullness(row.share)} max="1" value=${row.share}
      aria-label=${`${row.title}: ${percent(row.share)} used`}></progress>
  `;
}
