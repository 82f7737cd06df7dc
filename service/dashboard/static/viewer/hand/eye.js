// The eye of the viewer. It is held at a place that the user has chosen; or it is free, and follows the pointer, or
// sways gently while nobody steers it. `isCalm` is for users who want no motion: it does not sway, and does not glide.
import { flung, isStill, resting, speedOf, sprung, swayed } from "./motion.js";

const IDLE_MS = 1500; // The time without a pointer after which the eye sways.
const LONGEST_STEP_S = 0.1; // After a pause, for example in a hidden tab, the eye does not jump.

export class Eye {
  constructor(home, isCalm) {
    this.now = resting(home);
    this.goal = home;
    this.home = home;
    this.isCalm = isCalm;
    this.isFree = true;
    this.isHovered = false;
    this.trail = null; // of the places of a drag
    this.idle_ms = null; // the time at which nobody steered any more
    this.sway = null; // {from, since_ms}
    this.last_ms = null;
  }

  get place() {
    return { x: this.now.x, y: this.now.y };
  }

  get isDragged() {
    return this.trail !== null;
  }

  hold(place) {
    this.isFree = false;
    this.goal = place;
    this.sway = null;
  }

  // Lets the eye go: it follows the pointer, or sways.
  free(now_ms) {
    if (this.isFree) return;
    this.isFree = true;
    this.idle_ms = now_ms - IDLE_MS; // It was asked for, so it sways at once.
  }

  hover(place) {
    this.isHovered = true;
    this.sway = null;
    this.goal = place;
  }

  leave(now_ms) {
    this.isHovered = false;
    this.idle_ms = now_ms;
  }

  // A drag moves the eye at once.
  drag(place, now_ms) {
    this.isFree = false;
    this.sway = null;
    this.trail = [...(this.trail ?? []).slice(-7), { ...place, at_ms: now_ms }];
    this.goal = place;
    this.now = resting(place);
  }

  // The end of a drag: the eye goes on a little. Returns where it comes to rest.
  release(now_ms) {
    const trail = this.trail ?? [];
    this.trail = null;
    if (this.isCalm || !trail.length) return this.goal;
    const speed = speedOf(trail, now_ms);
    this.goal = flung(this.goal, speed);
    return this.goal;
  }

  get isSwaying() {
    return this.isFree && !this.isHovered && !this.isCalm;
  }

  // Moves on to a time; returns whether the eye moves on after it.
  step(now_ms) {
    const dt_s = Math.min(LONGEST_STEP_S, (now_ms - (this.last_ms ?? now_ms)) / 1000);
    this.last_ms = now_ms;
    this.idle_ms ??= now_ms;
    if (this.isSwaying && now_ms - this.idle_ms >= IDLE_MS) {
      this.sway ??= { from: this.place, since_ms: now_ms };
      this.goal = swayed(this.sway.from, (now_ms - this.sway.since_ms) / 1000);
      this.now = resting(this.goal);
      return true;
    }
    this.now = this.isCalm || this.isDragged ? resting(this.goal) : sprung(this.now, this.goal, dt_s);
    const isMoving = !isStill(this.now, this.goal) || this.isSwaying;
    if (!isMoving) this.last_ms = null;
    return isMoving;
  }
}
