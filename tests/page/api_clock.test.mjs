// The time of the service against that of this computer.
import assert from "node:assert/strict";
import { test } from "node:test";
import { hearDate, nowMs } from "../../service/dashboard/static/api/clock.js";

const away_ms = () => nowMs() - Date.now();
const dateIn = (ms) => new Date(Date.now() + ms).toUTCString();

test("a clock that is wrong by a day is put right, and a right one is left alone", () => {
  for (const day_ms of [-86_400_000, 86_400_000]) {
    hearDate(dateIn(day_ms));
    assert.ok(Math.abs(away_ms() - day_ms) < 2000, `${away_ms()}`);
  }
  hearDate(null);
  assert.ok(away_ms() > 80_000_000, "an answer without a date says nothing");
  hearDate(dateIn(-1500));
  assert.ok(Math.abs(away_ms()) < 100);
});
