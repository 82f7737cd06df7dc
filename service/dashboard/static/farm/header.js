// The header of the page: the name, the health of the farm, and the state of the connection.
import { link, logOut } from "../api/operations.js";
import { bytes, many } from "../shared/format.js";
import { html } from "../shared/html.js";
import { forgetDraft } from "../new-job/draft.js";
import { maySubmit, useKnown } from "../state/store.js";

const LINKS = {
  starting: "",
  live: "",
  polling: "Live updates are interrupted; polling.",
  lost: "Connection lost, trying again …",
};

const ACCOUNT = ["account", "keys", "audit"]; // The pages behind the link to the account.

export function Header({ here }) {
  const link = useKnown((known) => known.link);
  const isOutdated = useKnown((known) => known.isOutdated);
  const health = useKnown((known) => known.health);
  const session = useKnown((known) => known.session);
  const canSubmit = useKnown(maySubmit);
  return html`
    <header class="top">
      <a class="brand" href="#/"><img src=${document.body.dataset.logo} alt="" width="24" height="24" />
        <span>Lippmann</span></a>
      <${Health} health=${health} stale=${link === "lost"} />
      ${
        session &&
        html`
          <a class="button plain" href="#/farm" aria-current=${here === "farm" ? "page" : null}>Farm</a>
        `
      }
      ${
        session &&
        html`
        <a class="button plain" href="#/account" title="Your account, limits and keys"
          aria-current=${ACCOUNT.includes(here) ? "page" : null}>Account</a>
      `
      }
      ${session && html`<${HelpPage} />`}
      ${session && html`<${LogOut} session=${session} />`}
      ${
        canSubmit &&
        html`
        <a class="button primary" href="#/new" aria-current=${here === "new" ? "page" : null}>New job</a>
      `
      }
    </header>
    <p class="link ${link}" role="status" aria-live="polite">
      ${LINKS[link]}
      ${isOutdated && html`Lippmann was updated. <button onClick=${() => location.reload()}>Reload the page</button>`}
    </p>
  `;
}

const UNCONFINED = "A worker has no sandbox: it renders only the scenes that come with Lippmann.";

const confinement = (sandboxes) => (sandboxes?.length ? `Scenes run in: ${sandboxes.join(", ")}` : "");

const HelpPage = () => html`<a class="button plain manual" href=${link("/help/")} target="_blank">Help</a>`;

function LogOut({ session }) {
  const leave = () => {
    forgetDraft(); // The next one at this tab is somebody else.
    logOut().finally(() => location.replace(link("/")));
  };
  return html`
    <button class="plain" title="Logged in as ${session.name} (${session.role})" onClick=${leave}>Log out</button>
  `;
}

function Health({ health, stale }) {
  if (!health) return html`<ul class="health" aria-label="Health of the farm" tabindex="0"></ul>`;
  const { workers, slots, sandboxes, broker, store, database, coordinator } = health;
  const known = workers !== null;
  const troubles = (health.faults ?? []).filter((fault) => fault.component === "workers").map((fault) => fault.message);
  const room = store.free_bytes === null ? "store ok" : `${bytes(store.free_bytes)} free`;
  return html`
    <ul class="health ${stale ? "stale" : ""}" aria-label="Health of the farm" tabindex="0">
      <${Light} ok=${known && workers > 0} title=${known ? confinement(sandboxes) : "The broker does not answer."}
        text=${known ? `${many(workers, "worker")}, ${many(slots, "slot")}` : "workers unknown"} />
      ${sandboxes?.includes("none") && html`<${Light} ok=${false} title=${UNCONFINED} text="no sandbox" />`}
      ${
        troubles.length > 0 &&
        html`
        <${Light} ok=${false} title=${troubles.join(" ")} text=${`${many(troubles.length, "worker")} in trouble`} />`
      }
      ${
        health.notes?.length > 0 &&
        html`
        <${Light} ok=${false} title=${health.notes.join(" ")}
          text=${`${many(health.notes.length, "worker")} of another release`} />`
      }
      <${Light} ok=${broker.ok} title=${broker.detail} text=${broker.ok ? "broker ok" : "broker degraded"} />
      ${!database.ok && html`<${Light} ok=${false} title=${database.detail} text="database degraded" />`}
      ${
        !coordinator.ok &&
        html`
        <${Light} ok=${false} title="No service process schedules tasks." text="no coordinator" />`
      }
      <${Light} ok=${store.ok} title=${store.detail} text=${store.ok ? room : "store degraded"} />
    </ul>
  `;
}

const Light = ({ ok, text, title }) => html`<li class=${ok ? "ok" : "bad"} title=${title || null}>${text}</li>`;
