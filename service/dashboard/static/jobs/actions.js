// What may be done with a job: buttons for the actions that the service allows, or the reason why there are none.
import { useState } from "preact/hooks";
import { removeJob, sendAction } from "../api/operations.js";
import { Confirm } from "../shared/confirm.js";
import { html } from "../shared/html.js";
import { dropJob, fetchJob, mayChange, useKnown } from "../state/store.js";
import { RemoveQuestion } from "./remove.js";

// The service lists with every job the actions that are allowed. Others have no button.
const LABELS = {
  pause: "Pause",
  resume: "Resume",
  cancel: "Cancel",
  retry: "Retry",
  repair: "Repair",
  skip: "Skip failed frames",
  remove: "Remove",
};
const MEANINGS = {
  pause: "Running tasks finish, and no others start.",
  resume: "Tasks start again.",
  cancel: "Ends the job; finished frames stay.",
  retry: "Does what is not done once more.",
  repair: "Verifies every file of the job, and makes the missing and damaged ones again.",
  skip: "Makes the outputs without the failed frames.",
  remove: "Deletes the job and all its files.",
};
const ASKED = ["cancel", "remove"];
const canBegin = (job, action) => action in LABELS && (action !== "skip" || job.tasks.failed > 0);

export function Actions({ job }) {
  const session = useKnown((known) => known.session);
  const canChange = useKnown((known) => mayChange(known, job), [job.owner_id]);
  if (!session) return null;
  if (canChange) return html`<${Buttons} job=${job} />`;
  const isViewer = session.role === "viewer";
  return html`<p class="quiet">
    ${isViewer ? "Your key may look, and change nothing." : `Only ${job.owner} and admins change this job.`}
  </p>`;
}

function Buttons({ job }) {
  const [busy, setBusy] = useState(false);
  const [fault, setFault] = useState("");
  const [asked, setAsked] = useState("");
  const run = async (action) => {
    setBusy(true);
    setFault("");
    try {
      if (action === "remove") {
        await removeJob(job.id);
        dropJob(job.id);
        location.hash = "#/";
      } else await fetchJob(() => sendAction(job.id, action));
    } catch (error) {
      setFault(error.message);
    }
    setBusy(false);
  };
  const begin = (action) => (ASKED.includes(action) ? setAsked(action) : run(action));
  const answer = (isYes) => {
    setAsked("");
    if (isYes) run(asked);
  };
  return html`
    <div class="actions">
      ${job.actions
        .filter((action) => canBegin(job, action))
        .map(
          (action) => html`
        <button key=${action} title=${MEANINGS[action]} disabled=${busy} onClick=${() => begin(action)}>
          ${LABELS[action]}
        </button>
      `,
        )}
    </div>
    ${fault && html`<p class="fault" role="alert">${fault}</p>`}
    ${asked === "cancel" && html`<${CancelQuestion} answer=${answer} />`}
    ${asked === "remove" && html`<${RemoveQuestion} job=${job} answer=${answer} />`}
  `;
}

const CancelQuestion = ({ answer }) => html`
  <${Confirm} title="Cancel this job?" yes="Cancel the job" no="Keep the job" answer=${answer}>
    <p>Running tasks are stopped. Finished frames stay, and a retry continues from there.</p>
  <//>
`;
