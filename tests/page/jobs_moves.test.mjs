// The order of work, and the priorities that change it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { neighbours, placeOf, planMove } from "../../service/dashboard/static/jobs/list/moves.js";

const jobs = (...priorities) => priorities.map((priority, at) => ({ id: `${at}`, priority }));
const inOrder = (list) =>
  [...list].sort((one, other) => other.priority - one.priority || (one.id < other.id ? -1 : 1)).map(({ id }) => id);
const put = (list, changes) => list.map((job) => ({ ...job, ...changes.find(({ id }) => id === job.id) }));

test("between two jobs there is a number", () => {
  assert.deepEqual(planMove(jobs(80, 50, 10), 2, 1), [{ id: "2", priority: 65 }]);
  assert.deepEqual(planMove(jobs(80, 50, 10), 0, 1), [{ id: "0", priority: 29 }]);
  assert.deepEqual(planMove(jobs(51, 50, 50), 2, 1), [{ id: "2", priority: 51 }]);
});

test("the first and the last place are beyond the others, and within 0 to 100", () => {
  assert.deepEqual(planMove(jobs(80, 50), 1, 0), [{ id: "1", priority: 91 }]);
  assert.deepEqual(planMove(jobs(95, 50), 1, 0), [{ id: "1", priority: 100 }]);
  assert.deepEqual(planMove(jobs(80, 50), 0, 1), [{ id: "0", priority: 39 }]);
  assert.deepEqual(planMove(jobs(80, 3), 0, 1), [{ id: "0", priority: 0 }]);
  assert.deepEqual(planMove(jobs(80, 50), 1, 1), []);
});

test("where equal numbers leave no room, the fewest jobs change", () => {
  const changes = planMove(jobs(50, 50, 50, 50), 3, 1);
  assert.deepEqual(
    changes.map(({ id }) => id),
    ["0", "3"],
  );
  assert.deepEqual(planMove(jobs(100, 100, 90), 2, 1), [{ id: "1", priority: 89 }]);
});

test("jobs of others keep their numbers, also if there is then no room", () => {
  const list = jobs(50, 50, 50);
  list[0].isFixed = true;
  assert.deepEqual(
    planMove(list, 2, 1).map(({ id }) => id),
    ["2", "1"],
  );
  list[1].isFixed = true;
  assert.equal(planMove(list, 2, 1), null);
});

test("after every move of some lists the order is the one that was wanted, with priorities from 0 to 100", () => {
  const lists = [
    jobs(100, 100, 99, 0, 0),
    jobs(50, 50, 50, 50, 50),
    jobs(9, 8, 7, 7, 6),
    jobs(0, 0, 0),
    jobs(100, 100),
  ];
  for (const list of lists)
    for (let from = 0; from < list.length; from++)
      for (let to = 0; to < list.length; to++) {
        const ids = list.map(({ id }) => id);
        ids.splice(to, 0, ...ids.splice(from, 1));
        const after = put(list, planMove(list, from, to));
        assert.deepEqual(inOrder(after), ids, JSON.stringify([list, from, to, after]));
        assert.ok(after.every(({ priority }) => priority >= 0 && priority <= 100 && Number.isInteger(priority)));
      }
});

test("a dragged row stays among the rows", () => {
  assert.deepEqual([placeOf(-5, 78, 3), placeOf(80, 78, 3), placeOf(9999, 78, 3)], [0, 1, 3]);
});

test("a row changes places with the open jobs that are loaded around it", () => {
  const known = Object.fromEntries(
    ["a", "b", "c", "d", "e"].map((id) => [id, { id, priority: 50, ended_at: id === "e" ? "then" : null }]),
  );
  const ids = { 3: "a", 4: "b", 5: "c", 7: "d" };
  const { first, jobs: found } = neighbours(ids, known, 4, ({ id }) => id !== "a");
  assert.deepEqual(
    [first, found.map(({ id, isFixed }) => [id, isFixed])],
    [
      3,
      [
        ["a", true],
        ["b", false],
        ["c", false],
      ],
    ],
  );
  assert.deepEqual(neighbours({ 0: "b", 1: "e" }, known, 0, () => true).jobs.length, 1);
});
