// Starts the page. The address selects the view; see shared/address.js.
import { render } from "preact";
import { useEffect, useErrorBoundary, useLayoutEffect } from "preact/hooks";
import { start as startFocus } from "./shared/focus.js";
import { html } from "./shared/html.js";
import { arrive, start as startScroll } from "./shared/scroll.js";
import { read } from "./shared/address.js";
import { useAddress } from "./shared/use_address.js";
import { Farm } from "./farm/farm.js";
import { Header } from "./farm/header.js";
import { Compare } from "./jobs/compare/compare.js";
import { Job } from "./jobs/job.js";
import { JobList } from "./jobs/list/list.js";
import { hrefOf, isFiltered, isSame, parseQuery } from "./jobs/list/list_query.js";
import { Account } from "./account/account.js";
import { Audit } from "./account/audit.js";
import { Keys } from "./account/keys.js";
import { start } from "./state/live.js";
import { change, getState, useKnown } from "./state/store.js";
import { Submit } from "./new-job/submit.js";

const wide = matchMedia("(min-width: 56rem)");
const TITLES = { list: "Lippmann", wrong: "No such page – Lippmann" }; // The other pages set theirs.

function App() {
  const here = useAddress();
  const isLoaded = useKnown((known) => known.list.isLoaded);
  const page = [here.view, ...here.ids].join("/");
  useLayoutEffect(arrive, [page]);
  useEffect(() => {
    if (here.view in TITLES) document.title = TITLES[here.view];
  }, [page]);
  useEffect(() => {
    // On a wide screen the first job is open beside the list.
    const { jobs, list } = getState();
    const first = Object.values(list.ids).find((id) => id in jobs); // Those that were removed may still be listed.
    const now = read(); // The user may have gone on in the meantime, to another page or another order of the list.
    const isList = here.view === "list" && now.view === "list";
    if (!isList || !isLoaded || !wide.matches || !isSame(list.query, parseQuery(now.query))) return;
    if (first) location.replace(hrefOf(first, list.query));
    else if (!isFiltered(list.query)) location.replace("#/new");
  }, [here.view, isLoaded]);
  return html`
    <a class="skip" href="#main" onClick=${skip}>Skip to the job</a>
    <${Header} here=${here.view} />
    <div class="columns" data-view=${here.view}>
      <${JobList} open=${here.id} isMain=${here.view === "list"} />
      <div id="main" role=${here.view === "list" ? null : "main"} tabindex="-1">
        <${Guard} key=${page}>
        ${here.view === "new" && html`<${Submit} />`}
        ${here.view === "account" && html`<${Account} />`}
        ${here.view === "keys" && html`<${Keys} />`}
        ${here.view === "audit" && html`<${Audit} query=${here.query} />`}
        ${here.view === "farm" && html`<${Farm} />`}
        ${here.view === "job" && html`<${Job} key=${here.id} id=${here.id} />`}
        ${here.view === "compare" && html`<${Compare} key=${here.ids.join()} ids=${here.ids} />`}
        ${here.view === "wrong" && html`<${Wrong} />`}
        <//>
      </div>
    </div>
  `;
}

// A fault in one page leaves the list, the header and the way to other pages.
function Guard({ children }) {
  const [error] = useErrorBoundary((fault) => console.error(fault));
  if (!error) return children;
  return html`
    <article>
      <h1>This page cannot be drawn</h1>
      <p class="fault" role="alert">${error.message}</p>
      <p>This is a fault of the dashboard. <button onClick=${() => location.reload()}>Reload the page</button></p>
    </article>
  `;
}

const Wrong = () => html`
  <article>
    <h1>There is no such page</h1>
    <p>The address <code>${location.hash}</code> names no page of the dashboard. Check the link, or open the
      ${" "}<a href="#/">jobs</a>.</p>
  </article>
`;

// The fragment of the URL selects the view, so this link must not change it.
function skip(event) {
  event.preventDefault();
  document.getElementById("main").focus();
}

startScroll();
startFocus();
change({ session: JSON.parse(document.body.dataset.session) });
render(html`<${App} />`, document.body);
start();
