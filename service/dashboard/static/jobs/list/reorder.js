// Jobs change their places in the order of work: a handle is dragged, or moved by Alt and the arrow keys.
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { patchJob } from "../../api/operations.js";
import { Confirm } from "../../shared/confirm.js";
import { count, jobName, many } from "../../shared/format.js";
import { html } from "../../shared/html.js";
import { renewList } from "../../state/job_list.js";
import { fetchJob, getState, mayChange } from "../../state/store.js";
import { neighbours, placeOf, planMove } from "./moves.js";

export const isInOrderOfWork = (query) => query.sort === "work" && query.ascending;

const canMove = (job) => mayChange(getState(), job) && job.actions.includes("prioritise");

// What a list needs to let its jobs be moved: `rows` is the list, in which each row has a height of `row_px`.
export function useReorder(rows, query, row_px) {
  const [drag, setDrag] = useState(null); // {row, to} of the row that is dragged
  const [asked, setAsked] = useState(null); // {id, to, changes} that a question is about
  const [words, setWords] = useState("");
  const focused = useRef(null); // the job whose handle gets the focus when the list is drawn anew
  const isBusy = useRef(false);
  const ids = getState().list.ids;
  useLayoutEffect(() => {
    if (!focused.current) return;
    const handle = rows.current?.querySelector(`[data-job="${CSS.escape(focused.current)}"]`);
    if (handle) handle.focus();
    focused.current = null;
  }, [ids]);

  const set = async ({ id, to, changes }) => {
    isBusy.current = true;
    try {
      for (const change of changes) await fetchJob(() => patchJob(change.id, { priority: change.priority }));
      const priority = getState().jobs[id]?.priority;
      setWords(`${jobName(getState().jobs[id])} is number ${count(to + 1)} with priority ${priority}.`);
    } catch (error) {
      setWords(error.message);
    }
    isBusy.current = false;
    focused.current = id;
    await renewList({ force: true }).catch(() => {});
  };
  const move = (row, to) => {
    const { list, jobs } = getState();
    const around = neighbours(list.ids, jobs, row, canMove);
    const wanted = placeOf(to - around.first, 1, around.jobs.length - 1);
    const id = list.ids[row];
    const changes = planMove(around.jobs, row - around.first, wanted);
    if (!changes)
      return setWords("There is no room at this place, since jobs around it are others' and keep their priorities.");
    if (!changes.length) return setWords("");
    const plan = { id, to: around.first + wanted, changes };
    if (changes.some((change) => change.id !== id)) setAsked(plan);
    else set(plan);
  };

  const rowAt = (event) =>
    placeOf(event.clientY - rows.current.getBoundingClientRect().top, row_px, getState().list.total - 1);
  const handleOf = (row, job) => {
    if (!isInOrderOfWork(query) || job.ended_at || !canMove(job)) return null;
    const listeners = {
      onPointerDown: (event) => {
        if (event.button !== 0 || isBusy.current) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        setDrag({ row, to: row });
      },
      onPointerMove: (event) => drag && setDrag({ row: drag.row, to: rowAt(event) }),
      onPointerUp: () => (drag && move(drag.row, drag.to), setDrag(null)),
      onPointerCancel: () => setDrag(null),
      onKeyDown: (event) => {
        if (event.key === "Escape") setDrag(null);
        const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
        if (!step || !event.altKey) return;
        event.preventDefault();
        if (!isBusy.current) move(row, row + step);
      },
    };
    return html`
      <button class="handle" data-job=${job.id} ...${listeners} title="Drag, or Alt and an arrow key"
        aria-label="Place of ${jobName(job)}: Alt and an arrow key move it"
        aria-keyshortcuts="Alt+ArrowUp Alt+ArrowDown"
        ><span aria-hidden="true">⠿</span></button>
    `;
  };
  const answer = (isYes) => (setAsked(null), isYes && set(asked));
  const question = asked && html`<${Question} plan=${asked} answer=${answer} />`;
  return { drag, handleOf, words, question };
}

function Question({ plan, answer }) {
  const { jobs } = getState();
  const title = `Change ${many(plan.changes.length, "priority", "priorities")}?`;
  return html`
    <${Confirm} title=${title} yes="Change" no="Leave" answer=${answer}>
      <p>Equal priorities leave no room at this place, so that other jobs change too.</p>
      <ul>
        ${plan.changes.map(
          ({ id, priority }) => html`<li key=${id}>${jobName(jobs[id])}: ${jobs[id].priority} → ${priority}</li>`,
        )}
      </ul>
    <//>
  `;
}
