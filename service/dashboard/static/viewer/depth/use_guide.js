// The depth map of the frame that is shown. It is loaded after all views, when somebody looks around.
import { useMemo } from "preact/hooks";
import { useRequest } from "../../api/request.js";
import { depthMaps } from "./depth_shelf.js";
import { Guide, isGuided } from "./guide.js";

const PAUSE_MS = 150;

// Returns {guide, isWaiting}; the guide is null while there is none, and then the views are mixed where they are.
export function useGuide(atlas, isWanted) {
  const frameViews = isWanted && atlas?.size === "whole" && isGuided(atlas.frameViews) ? atlas.frameViews : null;
  const url = frameViews?.depth_map.url ?? null;
  const found = useRequest(url, async () => ({ url, map: await depthMaps.get(url) }), PAUSE_MS);
  const map = url !== null && found.value?.url === url ? found.value.map : null;
  const fits = map?.rows === frameViews?.view_rows && map?.cols === frameViews?.view_cols;
  const guide = useMemo(() => (map && fits ? new Guide(frameViews, map) : null), [map, frameViews]);
  return { guide, isWaiting: url !== null && !map && !found.fault };
}
