// What the pages of the account say of limits and of the audit log.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { ACTIONS, actionWords, filterOf, pageOf } from "../../service/dashboard/static/account/audit_words.js";
import { fullness, usageGroups } from "../../service/dashboard/static/account/usage_words.js";

const schemas = JSON.parse(readFileSync(new URL("../../service/openapi.json", import.meta.url), "utf8")).components
  .schemas;

test("the choice has every action of the API", () => {
  assert.deepEqual([...ACTIONS].sort(), [...schemas.AuditAction.enum].sort());
  assert.equal(actionWords("create-worker-key"), "create worker key");
});

test("every limit of the API has a title of its own and a group", () => {
  const items = Object.keys(schemas.KeyLimits.properties).map((name) => ({ name, used: 1, limit: 2, source: "x" }));
  const rows = usageGroups(items).flatMap(([, found]) => found);
  assert.equal(new Set(rows.map(({ title }) => title)).size, items.length);
  assert.deepEqual(
    rows.filter(({ title, name }) => title === name.replaceAll("_", " ")),
    [],
  );
});

test("a limit is written in its unit, with the share that is used and who sets it", () => {
  const [[, [stored, slots]]] = usageGroups([
    { name: "artifacts_mb", used: 1500, limit: 2000, source: "the limit artifacts_mb of the key" },
    { name: "slots", used: null, limit: 8, source: "LIPPMANN_MAX_SLOTS of the farm" },
  ]);
  assert.deepEqual(
    [stored.used, stored.limit, stored.share, stored.source],
    ["1.5 GB", "2 GB", 0.75, "set by your key"],
  );
  assert.deepEqual([slots.used, slots.share, slots.source], [null, null, "set by the farm"]);
});

test("a limit is marked before and when it is reached", () => {
  assert.deepEqual([0.79, 0.8, 1].map(fullness), ["", "paused", "failed"]);
});

test("an entry leads to the page of its subject if there is one", () => {
  const page = (action, subject) => pageOf({ action, subject });
  assert.equal(page("cancel-job", "1m8n"), "#/jobs/1m8n");
  assert.equal(page("end-task", "1m8n-7"), "#/jobs/1m8n");
  assert.equal(page("drain-worker", "render-7"), "#/farm");
  assert.equal(page("remove-job", "1m8n"), null);
  assert.equal(page("create-worker-key", "0011"), null);
});

test("a filter has only what is chosen, and no action that the API refuses", () => {
  const filter = (text) => filterOf(new URLSearchParams(text));
  assert.deepEqual(filter("action=log-in&name=+ann+&subject="), { action: "log-in", name: "ann" });
  assert.deepEqual(filter("action=sing"), {});
});
