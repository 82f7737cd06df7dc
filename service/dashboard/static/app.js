// Starts the page. The fragment of the URL selects the view:
//   #/            the list        #/jobs/<id>   a job        #/new   a new job        #/keys   the keys, for admins
import { render } from "preact";
import { useEffect, useState } from "preact/hooks";
import { html } from "./shared/html.js";
import { Header } from "./farm/header.js";
import { Job } from "./jobs/job.js";
import { JobList } from "./jobs/list.js";
import { Keys } from "./account/keys.js";
import { start } from "./state/live.js";
import { getState, newestFirst, useKnown } from "./state/store.js";
import { Submit } from "./new-job/submit.js";

const wide = matchMedia("(min-width: 56rem)");

function place() {
  const [, first, second] = location.hash.split("/");
  if (first === "new" || first === "keys") return { view: first };
  if (first === "jobs" && second) return { view: "job", id: decodeURIComponent(second) };
  return { view: "list" };
}

function App() {
  const [here, setHere] = useState(place());
  const isLoaded = useKnown((known) => known.jobsLoaded);
  useEffect(() => {
    const follow = () => setHere(place());
    addEventListener("hashchange", follow);
    return () => removeEventListener("hashchange", follow);
  }, []);
  useEffect(() => {
    // On a wide screen the newest job is open beside the list.
    const newest = newestFirst(getState().jobs)[0];
    if (here.view === "list" && isLoaded && wide.matches) location.replace(newest ? `#/jobs/${newest.id}` : "#/new");
  }, [here.view, isLoaded]);
  return html`
    <a class="skip" href="#main" onClick=${skip}>Skip to the job</a>
    <${Header} here=${here.view} />
    <div class="columns" data-view=${here.view}>
      <${JobList} open=${here.id} />
      <main id="main" tabindex="-1">
        ${here.view === "new" && html`<${Submit} />`}
        ${here.view === "keys" && html`<${Keys} />`}
        ${here.view === "job" && html`<${Job} key=${here.id} id=${here.id} />`}
      </main>
    </div>
  `;
}

// The fragment of the URL selects the view, so this link must not change it.
function skip(event) {
  event.preventDefault();
  document.getElementById("main").focus();
}

render(html`<${App} />`, document.body);
start();
