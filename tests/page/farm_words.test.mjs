// What the page of the farm says of workers and tasks.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  enginesOf,
  figures,
  loadOf,
  secondsAgo,
  taskPlace,
  tasksByWorker,
  workerActions,
  workerState,
} from "../../service/dashboard/static/farm/words.js";

const WORKER = {
  name: "render-7",
  slots: 4,
  running: 0,
  closed: null,
  fault: null,
  excluded: false,
  drained: false,
  avoided_by: 0,
  not_claiming_since_s: null,
  hours: null,
  version_note: null,
  povray: "3.7.0.10",
  engine_versions: {},
};
const worker = (changes) => ({ ...WORKER, ...changes });
const actions = (changes) => workerActions(worker(changes)).map(([action]) => action);

test("a worker is idle, working or busy by its tasks", () => {
  const words = [0, 1, 4].map((running) => workerState(worker({ running })).word);
  assert.deepEqual(words, ["idle", "working", "busy"]);
});

test("what an admin did with a worker comes before what it is itself", () => {
  const fault = "No room on the scratch disk";
  assert.equal(workerState(worker({ fault, excluded: true, closed: "draining" })).word, "excluded");
  assert.equal(workerState(worker({ fault, drained: true })).word, "draining");
  assert.deepEqual(workerState(worker({ fault })), { word: "at fault", tone: "failed", why: `${fault}.` });
});

test("a drained worker says whether it still finishes tasks, and who drained it", () => {
  const busy = workerState(worker({ closed: "draining", drained: true, running: 2 }));
  assert.equal(busy.word, "draining");
  assert.match(busy.why, /^An admin has drained it.*It finishes its tasks\.$/);
  const over = workerState(worker({ closed: "draining" }));
  assert.deepEqual([over.word, over.why], ["drained", "A signal has drained it."]);
});

test("only what is possible is offered", () => {
  assert.deepEqual(actions({}), ["drain", "exclude"]);
  assert.deepEqual(actions({ drained: true, closed: "draining" }), ["undrain", "exclude"]);
  assert.deepEqual(actions({ closed: "draining" }), ["exclude"]);
  assert.deepEqual(actions({ excluded: true, drained: true }), ["include"]);
  assert.deepEqual(actions({ avoided_by: 2 }), ["drain", "exclude", "forgive"]);
});

test("engines are named with their versions, also those of an older worker", () => {
  assert.equal(
    enginesOf(worker({ engine_versions: { povray: "3.7", mitsuba: "3.5.2" } })),
    "POV-Ray 3.7, Mitsuba 3.5.2",
  );
  assert.equal(enginesOf(worker({})), "POV-Ray 3.7.0.10");
  assert.equal(enginesOf(worker({ povray: "none" })), "no engine");
});

test("the load is compared with the cores where both are known", () => {
  assert.equal(loadOf({ load: 3.14, cores: 8 }), "3.1 of 8 cores");
  assert.equal(loadOf({ load: 0, cores: 1 }), "0.0 of 1 core");
  assert.equal(loadOf({ load: null, cores: 8 }), "not known");
});

test("a beat in the future is now", () => {
  assert.equal(secondsAgo(100, 97), "0 s ago");
  assert.equal(secondsAgo(100, 175), "1 min 15 s ago");
});

test("a task is named by what it makes", () => {
  assert.equal(taskPlace({ kind: "probe" }), "probe");
  assert.equal(taskPlace({ kind: "render", frame: 3, tile: { row: 0, col: 2 } }), "frame 3, tile 1.3");
  assert.equal(taskPlace({ kind: "assemble", frame: 3, tile: null }), "frame 3, assembly");
  assert.equal(taskPlace({ kind: "encode", frame: null, output: "views.mp4" }), "views.mp4");
});

test("tasks are grouped by worker, and orders in the queue belong to none", () => {
  const tasks = [
    { id: "a", worker: "x" },
    { id: "b", worker: null },
    { id: "c", worker: "x" },
  ];
  assert.deepEqual(
    Object.entries(tasksByWorker(tasks)).map(([name, own]) => [name, own.length]),
    [["x", 2]],
  );
});

test("the figures count only the slots of workers that take orders", () => {
  const work = {
    tasks: [{ status: "running" }, { status: "dispatched" }],
    free_bytes: 2e12,
    free_files: null,
    artifact_bytes: 1500,
    waiting: [
      { jobs: 2, ready_tasks: 7 },
      { jobs: 1, ready_tasks: 0 },
    ],
  };
  const shown = figures([worker({}), worker({ closed: "hours" })], work).map(([, value]) => value);
  assert.deepEqual(shown, ["2", "1 of 4", "3 jobs", "2 TB free", "1.5 kB"]);
});
