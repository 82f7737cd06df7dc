// Two eyes among the views, and the picture for red-cyan glasses.
import { clamp, numbersAt, placeOf } from "./views.js";

export const EYES_APART_MM = 63; // The mean of adults (Dodgson, Proc. SPIE 5291, 2004).
export const EYES = [
  ["one", "One eye"],
  ["anaglyph", "Red-cyan"],
  ["side_by_side", "Side by side"],
  ["cross_eyed", "Cross-eyed"],
];
export const LEAST_APART_MM = 1;
export const MOST_APART_MM = 200;

// The shares of red, green and blue of the left and of the right picture, by rows: red, green and blue of the result,
// in linear light, for red-cyan glasses (E. Dubois, Proc. IEEE ICASSP 2001), as in lightfield/observer/stereo.py.
export const LEFT = [
  [0.4561, 0.500484, 0.176381],
  [-0.0400822, -0.0378246, -0.0157589],
  [-0.0152161, -0.0205971, -0.00546856],
].flat();
export const RIGHT = [
  [-0.0434706, -0.0879388, -0.00155529],
  [0.378476, 0.73364, -0.0184503],
  [-0.0721527, -0.112961, 1.2264],
].flat();

// The distance between the positions of an eye from which neighbouring views are seen, at the viewing distance.
export const viewStep = ({ pitch_mm, gap_mm, us, viewing_distance_mm }) =>
  (viewing_distance_mm * pitch_mm) / us / gap_mm;

// The number of views between two eyes.
export const viewsApart = (frameViews, apart_mm) => apart_mm / viewStep(frameViews);

// The places of the left and the right eye around a place, as far apart as there are views.
export function eyePair(frameViews, place, apart_mm) {
  const [u, v] = numbersAt(frameViews, place);
  const most = frameViews.us - 1;
  const apart = Math.min(most, viewsApart(frameViews, apart_mm));
  const left = clamp(u - apart / 2, 0, most - apart);
  return [placeOf(frameViews, left, v), placeOf(frameViews, left + apart, v)];
}

// Where an observer at the viewing distance sees a place, in mm to the right and up.
export function eyeAt(frameViews, place) {
  const [u, v] = numbersAt(frameViews, place);
  const step_mm = viewStep(frameViews);
  const rounded = (mm) => Number(mm.toFixed(2));
  return {
    x: rounded((u - (frameViews.us - 1) / 2) * step_mm),
    y: rounded(-(v - (frameViews.vs - 1) / 2) * step_mm),
    z: frameViews.viewing_distance_mm,
  };
}
