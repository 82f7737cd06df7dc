// How the eye moves. A place is (x, y) from -1 to 1, the outermost views; right and down are positive; see views.js.
// The scene turns with the hand, as behind glass: what is near moves to where the hand moves, so the eye moves against
// it. Turning by 1 is half of the way between the outermost views.
import { clamp } from "../painting/views.js";

const SPRING_PER_S = 11; // The eye has covered nine tenths of its way after about 0.35 s.
const FLING_S = 0.18; // After a release the eye goes on for so long at its last speed, and comes to rest.
const STILL = 5e-4; // Less than a pixel of any stage.
const SWAY_S = 9; // The period of the sway.
const SWAY = { x: 0.5, y: 0.18 };
const SETTLE_S = 1.5; // The time from the last place to the path of the sway.

const within = ({ x, y }) => ({ x: clamp(x), y: clamp(y) });

// The place after the scene has been turned by so many parts of the stage to the right and down.
export const turned = (place, across, down) => within({ x: place.x - 2 * across, y: place.y - 2 * down });

// The place for a pointer at parts of the stage from its middle, -0.5 to 0.5.
export const hovered = (across, down) => turned({ x: 0, y: 0 }, across, down);

// The place for a phone that has been tilted by degrees since the beginning: `gamma` raises its left edge, `beta` its
// top edge. The eye stays where it is, so it moves to the edge that comes nearer.
export const tilted = (gamma_deg, beta_deg, reach_deg = 20) =>
  within({ x: -gamma_deg / reach_deg, y: -beta_deg / reach_deg });

// The tilt of a screen that is turned by an angle against its device, from the tilt of the device.
export function onScreen(gamma_deg, beta_deg, angle_deg) {
  if (angle_deg === 90) return [beta_deg, -gamma_deg];
  if (angle_deg === 180) return [-gamma_deg, -beta_deg];
  if (angle_deg === 270) return [-beta_deg, gamma_deg];
  return [gamma_deg, beta_deg];
}

// Where the eye comes to rest after a release at a speed, in places per second.
export const flung = (place, speed) => within({ x: place.x + FLING_S * speed.x, y: place.y + FLING_S * speed.y });

// The speed at the end of a drag: `trail` has {x, y, at_ms} of the last places.
export function speedOf(trail, now_ms, memory_ms = 90) {
  const recent = trail.filter(({ at_ms }) => now_ms - at_ms <= memory_ms);
  const [first, last] = [recent[0], recent.at(-1)];
  if (!first || last.at_ms - first.at_ms < 8) return { x: 0, y: 0 };
  const span_s = (last.at_ms - first.at_ms) / 1000;
  return { x: (last.x - first.x) / span_s, y: (last.y - first.y) / span_s };
}

// An eye at rest at a place.
export const resting = ({ x, y }) => ({ x, y, speed: { x: 0, y: 0 } });

// The eye after some time on a critically damped spring to its goal; it never overshoots from rest, and rests exactly
// at the goal.
export function sprung(eye, goal, dt_s) {
  const [x, speed_x] = spring(eye.x, eye.speed.x, goal.x, dt_s);
  const [y, speed_y] = spring(eye.y, eye.speed.y, goal.y, dt_s);
  const isThere = Math.hypot(x - goal.x, y - goal.y) < STILL && Math.hypot(speed_x, speed_y) < 20 * STILL;
  return isThere ? resting(goal) : { x, y, speed: { x: speed_x, y: speed_y } };
}

function spring(from, speed, goal, dt_s) {
  const fade = Math.exp(-SPRING_PER_S * dt_s);
  const away = from - goal;
  const pull = speed + SPRING_PER_S * away;
  return [goal + (away + pull * dt_s) * fade, (speed - SPRING_PER_S * pull * dt_s) * fade];
}

export const isStill = (eye, goal) => eye.x === goal.x && eye.y === goal.y && eye.speed.x === 0 && eye.speed.y === 0;

// The place of the sway so many seconds after it began at a place.
export function swayed(from, seconds) {
  const turn = (2 * Math.PI * seconds) / SWAY_S;
  const share = clamp(seconds / SETTLE_S, 0, 1);
  const mix = (begin, end) => begin + (end - begin) * share * share * (3 - 2 * share);
  return { x: mix(from.x, SWAY.x * Math.sin(turn)), y: mix(from.y, SWAY.y * Math.sin(2 * turn)) };
}
