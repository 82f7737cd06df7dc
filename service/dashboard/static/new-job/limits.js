// How much of each limit the job would use, beside its cost.
import { usageGroups } from "../account/usage_words.js";
import { html } from "../shared/html.js";
import { Documented } from "./form/documented.js";

const PAGE = "keys.html#limits-and-quotas";

const rowsOf = (limits) => usageGroups(limits).flatMap(([, rows]) => rows);

export function Limits({ limits }) {
  const beyond = new Set(limits.filter(({ exceeded }) => exceeded).map(({ name }) => name));
  return html`
    <section class="limits" aria-label="Limits">
      <h2>
        Limits${" "}<${Documented} page=${PAGE}>More<span class="unseen"> about limits</span><//>
      </h2>
      <dl>
        ${rowsOf(limits).map(
          ({ name, title, used, limit, source }) => html`
          <div key=${name} title=${`At most ${limit}, ${source}`} class=${beyond.has(name) ? "fault" : ""}>
            <dt>${title}</dt><dd>${used} of ${limit}</dd>
          </div>
        `,
        )}
      </dl>
    </section>
  `;
}

// The limits that the job exceeds, as sentences before it is submitted.
export const exceededWords = (limits) =>
  rowsOf(limits.filter(({ exceeded }) => exceeded)).map(
    ({ title, used, limit, source }) => `${title}: ${used}, and the limit is ${limit}, ${source}.`,
  );
