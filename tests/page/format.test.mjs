// Formats of numbers, durations and times.
import assert from "node:assert/strict";
import { test } from "node:test";
import { ago, by, bytes, duration, jobName, many, percent } from "../../service/dashboard/static/shared/format.js";

test("durations have the two units that matter", () => {
  const said = [0, 59.6, 61, 3599, 3600, 48 * 3600].map(duration);
  assert.deepEqual(said, ["0 s", "1 min 0 s", "1 min 1 s", "59 min", "1 h 0 min", "2 d 0 h"]);
});

test("a share is rounded down, so that only a whole job has 100 %", () => {
  assert.equal(percent(0.999), "99\u202f%");
  assert.equal(percent(1), "100\u202f%");
});

test("bytes have three digits", () => {
  assert.deepEqual([0, 999, 1234, 5.55e9].map(bytes), ["0 B", "999 B", "1.23 kB", "5.55 GB"]);
});

test("times of the last minute are now", () => {
  const now_ms = Date.parse("2026-01-01T12:00:00Z");
  const said = (time) => ago(time, now_ms);
  assert.equal(said("2026-01-01T11:59:30Z"), "just now");
  assert.equal(said("2026-01-01T11:00:00Z"), "1 h ago");
  assert.equal(said("2025-12-30T12:00:00Z"), "2 d ago");
});

test("counts", () => {
  assert.equal(many(1, "frame"), "1 frame");
  assert.equal(many(1234, "frame"), "1,234 frames");
  assert.equal(by(720, 1280), "720 × 1,280");
});

test("a job without a title, or with a blank one, is called by its scene", () => {
  const named = ["A pond", "", "  "].map((title) => jobName({ title, scene: "fish" }));
  assert.deepEqual(named, ["A pond", "fish", "fish"]);
});
