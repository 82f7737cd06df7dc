// The frames of a job that can be looked at.
import { useMemo, useRef } from "preact/hooks";
import { artifactPath, link } from "../../api/operations.js";
import { placeOfFrame, STATUSES } from "../../jobs/frames/frame_runs.js";
import { useKnown } from "../../state/store.js";
import { itemOf, numbersOf, placesAround } from "./frame_items.js";

const DONE = STATUSES.indexOf("done");
const NONE = { numbers: new Int32Array(0), statuses: new Uint8Array(0) };

// Returns what is known of the frames:
//   numbers            those that are done, in the order of the job
//   all                {numbers, statuses} of all frames, without any until they are loaded
//   itemOf(frame)      the paths of the pictures of a frame that is done
//   around(frame)      the places among `numbers` of a frame and of its neighbours
//   openStatus(frame)  the status of a frame that is not done; empty if it is done or not known
export function useFrames(job) {
  const known = useKnown(({ frames }) => (frames?.job === job.id ? frames : null), [job.id]);
  const grid = useKnown((known) => (known.grid?.job === job.id ? known.grid : null), [job.id]);
  const last = useRef({ job: null, numbers: [] });
  const numbers = useMemo(() => {
    const listed = (known?.pages ?? []).flatMap((page) => page.items).filter(({ status }) => status === "done");
    return numbersOf(
      listed.map(({ frame }) => frame),
      grid,
      DONE,
    );
  }, [known, grid]);
  // While the list is loaded again, the frames stay.
  if (numbers.length || last.current.job !== job.id) last.current = { job: job.id, numbers };
  return useMemo(() => {
    const shown = last.current.numbers;
    const done = new Set(shown);
    const all = grid ?? NONE;
    const openStatus = (frame) => {
      const at = done.has(frame) ? -1 : placeOfFrame(all.numbers, frame);
      return at < 0 ? "" : STATUSES[all.statuses[at]];
    };
    return {
      numbers: shown,
      all,
      itemOf: (frame) => {
        const item = itemOf(frame, (name) => artifactPath(job.id, name));
        return { ...item, thumbUrl: link(item.thumb) };
      },
      around: (frame) => placesAround(shown, frame, all.numbers),
      openStatus,
    };
  }, [last.current, grid]);
}
