// The frames of a job that can be looked at.
import { useMemo, useRef } from "preact/hooks";
import { link } from "../api/operations.js";
import { STATUSES } from "../jobs/frame_runs.js";
import { useKnown } from "../state/store.js";
import { itemLike, numbersOf } from "./frame_items.js";

// Returns {items, numbers, itemOf}: the frames of the loaded pages; the numbers of all frames that are known to be
// done; and the paths of the pictures of one of them.
export function useDoneFrames(job) {
  const known = useKnown(({ frames }) => (frames?.job === job.id ? frames : null), [job.id]);
  const grid = useKnown((known) => (known.grid?.job === job.id ? known.grid : null), [job.id]);
  const last = useRef({ job: null, items: [] });
  const items = useMemo(() => {
    const all = (known?.pages ?? []).flatMap((page) => page.items);
    return all.filter((item) => item.status === "done" && item.orthoscopic);
  }, [known]);
  // While the list is loaded again, the frames stay.
  if (items.length || last.current.job !== job.id) last.current = { job: job.id, items };
  return useMemo(() => {
    const shown = last.current.items;
    const byNumber = new Map(shown.map((item) => [item.frame, item]));
    const itemOf = (frame) => {
      const item = byNumber.get(frame) ?? (shown.length ? itemLike(shown[0], frame) : null);
      return item && { ...item, thumbUrl: item.thumb && link(item.thumb) };
    };
    return { items: shown, numbers: numbersOf(shown, grid, STATUSES.indexOf("done")), itemOf };
  }, [last.current, grid]);
}
