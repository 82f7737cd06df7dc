// What guides the mixing of views: for every view that is mixed, and for the eye, the depth of each pixel. The views
// are shifted by it, so that near things are not seen twice between views.
import { seenFrom } from "./depth_map.js";

export const UNKNOWN_MM = -60000; // It stands for an unknown depth, behind all others; half floats hold it.
// The largest view whose depth is estimated for this; its estimate takes the service about two seconds.
const ESTIMATED_PX = 256 ** 2;
const KEPT = 16;

// Whether the depth is worth its time: the true one always is.
export const isGuided = ({ view_rows, view_cols, depth_map }) =>
  depth_map.source === "truth" || view_rows * view_cols <= ESTIMATED_PX;

export class Guide {
  // `map` is the depth map of the central view.
  constructor(frameViews, map) {
    this.frameViews = frameViews;
    this.map = map;
    this.kept = new Map(); // of the views, the last ones
  }

  // The depths in mm that the view (u, v) shows, or an eye between views; by rows.
  depths([u, v]) {
    const { centre, depths } = this.frameViews;
    const seen = seenFrom(this.map, [u - centre[0], v - centre[1]], depths.lenses_per_mm);
    return seen.map((depth_mm) => (Number.isFinite(depth_mm) ? depth_mm : UNKNOWN_MM));
  }

  depthsOfView(number) {
    const key = String(number);
    const depths_mm = this.kept.get(key) ?? this.depths(number);
    this.kept.delete(key);
    this.kept.set(key, depths_mm);
    if (this.kept.size > KEPT) this.kept.delete(this.kept.keys().next().value);
    return depths_mm;
  }
}
