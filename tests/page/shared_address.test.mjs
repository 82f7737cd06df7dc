import assert from "node:assert/strict";
import test from "node:test";
import { parse, patched } from "../../service/dashboard/static/shared/address.js";

test("a fragment names a view, its ids, and the state inside the view", () => {
  const here = parse("#/jobs/ab%2Fc?frame=3&look=focus");
  assert.deepEqual([here.view, here.id, here.ids], ["job", "ab/c", ["ab/c"]]);
  assert.deepEqual(Object.fromEntries(here.query), { frame: "3", look: "focus" });
  for (const fragment of ["", "#", "#/"]) assert.equal(parse(fragment).view, "list");
  assert.equal(parse("#/new").view, "new");
});

test("what names no page is a wrong address", () => {
  for (const fragment of ["#/nothing", "#/jobs/", "#/jobs", "#/jobs/a/b", "#/new/a", "#/toString", "#/constructor/a"]) {
    assert.equal(parse(fragment).view, "wrong", fragment);
  }
  assert.equal(parse("#/jobs/%").id, "%");
});

test("a patch changes the named values and keeps the others", () => {
  const before = "#/jobs/a?frame=3&x=0.2";
  assert.equal(patched(before, { frame: 4, zoom: 2 }), "#/jobs/a?frame=4&x=0.2&zoom=2");
  assert.equal(patched(before, { frame: null, x: undefined }), "#/jobs/a");
  assert.equal(patched("", { q: "a&b" }), "#/?q=a%26b");
  assert.equal(parse(patched("", { q: "a&b" })).query.get("q"), "a&b");
});
