import assert from "node:assert/strict";
import { test } from "node:test";
import { Eye } from "../../service/dashboard/static/viewer/hand/eye.js";
import {
  hovered,
  onScreen,
  resting,
  speedOf,
  sprung,
  tilted,
  turned,
} from "../../service/dashboard/static/viewer/hand/motion.js";

const HOME = { x: 0, y: 0 };

test("a turn to the right moves the eye to the left, and not beyond the outermost view", () => {
  assert.deepEqual(turned(HOME, 0.25, -0.1), { x: -0.5, y: 0.2 });
  assert.deepEqual(turned(HOME, 3, 0), { x: -1, y: 0 });
  assert.deepEqual(hovered(0.25, -0.1), turned(HOME, 0.25, -0.1));
});

test("a phone whose left edge is raised shows the scene from the left", () => {
  assert.deepEqual(tilted(10, -5), { x: -0.5, y: 0.25 });
});

test("the spring reaches its goal without overshooting and rests there exactly", () => {
  let eye = resting({ x: -1, y: 0.5 });
  let steps = 0;
  for (; eye.x !== 1 || eye.y !== 0; steps++) {
    const before = eye.x;
    eye = sprung(eye, { x: 1, y: 0 }, 1 / 60);
    assert.ok(eye.x >= before && eye.x <= 1 && steps < 120);
  }
  assert.deepEqual(eye.speed, { x: 0, y: 0 });
  const [coarse, fine] = [0.1, 0.05].map((dt_s) => {
    let at = resting(HOME);
    for (let time = 0; time < 0.0999; time += dt_s) at = sprung(at, { x: 1, y: 0 }, dt_s);
    return at.x;
  });
  assert.ok(Math.abs(coarse - fine) < 1e-9, "the path does not depend on the number of steps");
});

test("a drag moves the eye at once, and after it the eye goes on a little", () => {
  const eye = new Eye(HOME, false);
  for (const step of [0, 1, 2, 3]) eye.drag({ x: -0.1 * step, y: 0 }, 16 * step);
  eye.step(48);
  assert.equal(eye.place.x, -0.1 * 3);
  assert.ok(eye.release(50).x < -0.4);
  assert.equal(eye.place.x, -0.1 * 3, "it glides, and does not jump");
  const calm = new Eye(HOME, true);
  for (const step of [0, 1, 2, 3]) calm.drag({ x: -0.1 * step, y: 0 }, 16 * step);
  assert.equal(calm.release(50).x, -0.1 * 3);
  assert.deepEqual(speedOf([{ x: 1, y: 0, at_ms: 0 }], 500), HOME);
});

test("a free eye sways while nobody steers, a held one and a calm one do not", () => {
  const swaying = new Eye(HOME, false);
  for (let time = 0; time < 6000; time += 16) swaying.step(time);
  assert.notDeepEqual(swaying.place, HOME);
  swaying.hold({ x: 0.5, y: 0 });
  for (let time = 6000; time < 9000; time += 16) swaying.step(time);
  assert.deepEqual(swaying.place, { x: 0.5, y: 0 });
  assert.equal(swaying.step(9016), false);
  const calm = new Eye(HOME, true);
  assert.equal(calm.step(0) || calm.step(6000), false);
  assert.deepEqual(calm.place, HOME);
});

test("the tilt of a phone on its side is that of its screen", () => {
  assert.deepEqual(onScreen(1, 2, 0), [1, 2]);
  // Whichever side it lies on, four quarter turns lead back.
  let tilt = [1, 2];
  for (let turns = 0; turns < 4; turns++) tilt = onScreen(...tilt, 90);
  assert.deepEqual(tilt, [1, 2]);
  assert.deepEqual(onScreen(...onScreen(1, 2, 90), 270), [1, 2]);
  assert.deepEqual(onScreen(...onScreen(1, 2, 90), 90), onScreen(1, 2, 180));
});
