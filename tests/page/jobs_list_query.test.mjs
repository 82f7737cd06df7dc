// The filters and the order of the list of jobs.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  addressOf,
  hrefOf,
  isFiltered,
  isNewestFirst,
  isSame,
  ownersOf,
  parseQuery,
  requestOf,
  SORTS,
} from "../../service/dashboard/static/jobs/list/list_query.js";

const of = (text) => parseQuery(new URLSearchParams(text));
const said = (query) => Object.entries(addressOf(query)).filter(([, value]) => value !== null);

test("an address and a query are inverses", () => {
  for (const sort of Object.keys(SORTS))
    for (const ascending of [true, false]) {
      const query = { search: "a & b=c", status: "open", owner: "ann", sort, ascending };
      assert.deepEqual(of(new URLSearchParams(said(query))), query);
    }
});

test("an address says only what differs from the newest jobs first", () => {
  assert.deepEqual(said(of("")), []);
  assert.ok(isNewestFirst(of("")));
  assert.ok(!isFiltered(of("frame=3&search=%20")));
  assert.ok(!isNewestFirst(of("sort=cost")));
});

test("values of an address that are none of ours are left out", () => {
  const query = of(`sort=colour&status=__proto__&ascending=perhaps&search=${"x".repeat(300)}`);
  assert.deepEqual([query.sort, query.status, query.ascending, query.search.length], ["created", "", false, 100]);
});

test("a request has the names and the statuses of the API", () => {
  const { status, sort, ascending, owner } = requestOf(of("status=ended&sort=time_left"));
  assert.deepEqual(status, ["done", "failed", "cancelled"]);
  assert.deepEqual([sort, ascending, owner], ["time_left", true, undefined]);
});

test("the address of a job keeps the filters", () => {
  assert.equal(hrefOf("01h", of("")), "#/jobs/01h");
  assert.equal(hrefOf("01h", of("search=a%20b&sort=cost")), "#/jobs/01h?search=a+b&sort=cost");
});

test("every owner is offered, each name once, and one's own jobs under one name", () => {
  const listed = [
    { owner_id: "k1", name: "zoe" },
    { owner_id: "k2", name: "ann" },
    { owner_id: "k3", name: "ann" },
    { owner_id: "me", name: "laptop" },
  ];
  const jobs = [
    { owner_id: "k9", owner: "shares" },
    { owner_id: "me", owner: "laptop" },
  ];
  assert.deepEqual(ownersOf(listed, jobs, { mine: "me", asked: "gone" }), ["ann", "gone", "shares", "zoe"]);
  assert.deepEqual(ownersOf([], [], { mine: "me", asked: "me" }), []);
});

test("queries are the same if they find the same jobs in the same order", () => {
  assert.ok(isSame(of("search=fish&sort=work"), of("sort=work&search=fish&frame=3")));
  assert.ok(!isSame(of("sort=work"), of("")));
  assert.ok(!isSame(null, of("")));
});
