import { clamp } from "../painting/views.js";

// The depths of the slider of the focus: about a hundred round steps over the useful range, and what a click adds.
export function scaleOf({ view_rows, view_cols, depths }, chosen_mm = null) {
  const { from_mm, to_mm, lenses_per_mm } = depths;
  const step_mm = 10 ** Math.ceil(Math.log10(Math.max(to_mm - from_mm, 1e-3) / 200)) / 2;
  const steps = (count) => Number((count * step_mm).toPrecision(9));
  const rounded = (depth_mm) => steps(Math.round(depth_mm / step_mm));
  const least_mm = steps(Math.ceil(from_mm / step_mm));
  const most_mm = steps(Math.floor(to_mm / step_mm));
  // What was clicked may lie beyond the planes of the stage, as long as the views of neighbours overlap.
  if (chosen_mm === null) return { step_mm, rounded, least_mm, most_mm };
  const [across, down] = lenses_per_mm;
  const rows_mm = (view_rows - 1) / Math.abs(down);
  const reach_mm = Math.floor(Math.min((view_cols - 1) / Math.abs(across), rows_mm) / step_mm) * step_mm;
  const kept_mm = rounded(clamp(chosen_mm, -reach_mm, reach_mm));
  return { step_mm, rounded, least_mm: Math.min(least_mm, kept_mm), most_mm: Math.max(most_mm, kept_mm) };
}
