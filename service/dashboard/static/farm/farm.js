// The page of the farm: workers, what they do, what waits and why, the last hours, and who uses how much.
import { useEffect, useState } from "preact/hooks";
import { endTask, restartTask, sendWorkerAction } from "../api/operations.js";
import { Confirm } from "../shared/confirm.js";
import { html } from "../shared/html.js";
import { useKnown } from "../state/store.js";
import { Charts } from "./charts.js";
import { Owners } from "./owners.js";
import { Stuck, Waiting } from "./queue.js";
import { useFarm } from "./use_farm.js";
import { figures, taskPlace } from "./words.js";
import { Workers } from "./workers.js";

export function Farm() {
  const farm = useFarm();
  const isAdmin = useKnown((known) => known.session?.role === "admin");
  const [said, setSaid] = useState(""); // for screen readers, and for what went wrong
  const [fault, setFault] = useState("");
  const [question, setQuestion] = useState(null);
  useEffect(() => {
    document.title = "Farm – Lippmann";
  }, []);
  const act = async (run, done) => {
    setFault("");
    try {
      await run();
      setSaid(done);
      await farm.renew();
    } catch (error) {
      setFault(error.message);
    }
  };
  const onWorker = (name, action, title) => act(() => sendWorkerAction(name, action), `${title}: ${name}.`);
  const onTask = (task, action) => setQuestion({ ...QUESTIONS[action](task), task });
  const answer = (isYes) => {
    const asked = question;
    setQuestion(null);
    if (isYes) act(() => asked.run(asked.task), asked.done);
  };
  return html`
    <article class="farm">
      <a class="back" href="#/">← All jobs</a>
      <h1>Farm</h1>
      <p class="unseen" role="status">${said}</p>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${farm.fault && html`<p class="fault" role="alert">${farm.fault} What is shown may be old.</p>`}
      ${!farm.work && !farm.fault && html`<p class="quiet">Loading …</p>`}
      ${
        farm.work &&
        html`
        <${Figures} items=${figures(farm.workers, farm.work)} />
        <${Stuck} tasks=${farm.work.tasks} act=${onTask} />
        <${Workers} farm=${farm} isAdmin=${isAdmin} act=${onWorker} />
        <${Waiting} work=${farm.work} />
        <${Charts} />
        <${Owners} />
      `
      }
      ${
        question &&
        html`
        <${Confirm} title=${question.title} yes=${question.button} no="Leave it" answer=${answer}>
          <p>${question.text}</p>
        <//>
      `
      }
    </article>
  `;
}

const QUESTIONS = {
  restart: (task) => ({
    title: `Run ${taskPlace(task)} of ${task.job_title} again?`,
    text: "Its attempt stops, and what it has done is lost. The task goes to another worker if there is one.",
    button: "Run it again",
    done: "The task runs again.",
    run: (chosen) => restartTask(chosen.job_id, chosen.id),
  }),
  end: (task) => ({
    title: `End ${taskPlace(task)} of ${task.job_title}?`,
    text: task.output
      ? "The output is not made. The job fails when its other outputs have ended."
      : "The job fails at once. Skip the frame or retry the job afterwards.",
    button: "End the task",
    done: "The task has ended.",
    run: (chosen) => endTask(chosen.job_id, chosen.id),
  }),
};

const Figures = ({ items }) => html`
  <dl class="figures">
    ${items.map(
      ([name, value, more]) => html`
      <div key=${name}><dt>${name}</dt><dd>${value}</dd><dd class="quiet">${more}</dd></div>
    `,
    )}
  </dl>
`;
