// The atlas of a frame, first a small one, and then the whole one if it is wanted.
import { useEffect, useMemo } from "preact/hooks";
import { useRequest } from "../../api/request.js";
import { read } from "../../shared/address.js";
import { Atlases } from "./atlases.js";
import { numberOf } from "../time/frame_items.js";
import { fromQuery } from "../stand.js";

// The atlases of a job. The first picture is asked for at once, and not after the page is painted and the frames of the
// job are listed.
export function useAtlases(job) {
  const atlases = useMemo(() => begun(job), [job.id]);
  useEffect(() => () => atlases.close(), [atlases]);
  return atlases;
}

function begun(job) {
  const atlases = new Atlases(job.id);
  const { frame, mode } = fromQuery(read().query);
  const first = frame ?? numberOf(job.poster);
  if (first !== null && mode === "look") atlases.get(first, "first").catch(() => {});
  return atlases;
}

// Returns {frameViews, atlas, isWaiting, fault}: the views of the frame; and the best atlas that is loaded, which is
// that of the frame before while none of this frame is.
export function useAtlas(atlases, frame, { isPainted, wantsWhole }) {
  const described = useRequest(frame === null ? null : `${frame}`, () => atlases.describe(frame));
  const wanted = isPainted && frame !== null;
  const first = useRequest(wanted ? `${frame}` : null, () => atlases.get(frame, "first"));
  const isFirstHere = first.value?.frame === frame;
  const whole = useRequest(wanted && wantsWhole && isFirstHere ? `${frame}` : null, () => atlases.get(frame, "whole"));
  const isWholeHere = wantsWhole && whole.value?.frame === frame;
  const atlas = isWholeHere ? whole.value : first.value;
  if (atlas) atlases.use(atlas.frame, atlas.size);
  return {
    frameViews: described.value?.frame === frame ? described.value : null,
    atlas: wanted ? atlas : null,
    isWaiting: wanted && !(wantsWhole ? isWholeHere : isFirstHere),
    fault: described.fault || (wanted ? first.fault || (wantsWhole && whole.fault) : ""),
  };
}
