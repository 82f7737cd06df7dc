// The form for a new job: fields from the schema, values by path, errors at their fields.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { faultsAt, hasFault, otherFaults } from "../../service/dashboard/static/new-job/form/faults.js";
import { groupsOf } from "../../service/dashboard/static/new-job/form/groups.js";
import {
  isSame,
  jobFileOf,
  jobOfJson,
  jsonOf,
  numberOf,
  numbersOf,
  textOf,
  valueAt,
  withValue,
} from "../../service/dashboard/static/new-job/job_file.js";
import {
  fieldOf,
  fieldsOf,
  formWith,
  startOf,
  parameterTitle,
} from "../../service/dashboard/static/new-job/form/schema.js";

const CONTRACT = JSON.parse(readFileSync(new URL("../../service/openapi.json", import.meta.url), "utf8"));
const JOB = { ...CONTRACT.components.schemas.JobSpec, components: CONTRACT.components };
const model = (name) => ({ ...CONTRACT.components.schemas[name], components: CONTRACT.components });
const field = (owner, name) => fieldOf(JOB, name, CONTRACT.components.schemas[owner].properties[name]);
const leaves = () => groupsOf(JOB).flatMap(({ first, more }) => [...first, ...more.flatMap(({ fields }) => fields)]);

test("every field of a job file stands once on the form or has a place of its own", () => {
  const paths = leaves().map(({ path }) => path);
  assert.equal(new Set(paths).size, paths.length);
  for (const name of Object.keys(JOB.properties)) {
    const isShown = paths.some((path) => path === name || path.startsWith(`${name}.`));
    assert.ok(isShown || ["scene", "parameters", "animation"].includes(name), name);
  }
  assert.deepEqual(
    groupsOf(JOB).map(({ name }) => name),
    ["scene", "time", "optics", "display", "outputs", "farm"],
  );
});

test("no field on the form lacks a label or an explanation", () => {
  assert.deepEqual(
    leaves()
      .filter(({ label, help }) => !label || !help)
      .map(({ path }) => path),
    [],
  );
});

test("every field on the form leads into the documentation", () => {
  for (const { path, more } of leaves()) assert.equal(more, `job-file.html#${path}`);
});

test("the device and the display stand together, away from the optics", () => {
  const { first, more } = groupsOf(JOB).find(({ name }) => name === "display");
  assert.deepEqual(
    first.map(({ path }) => path),
    ["rig.device", "display.viewing_distance_mm"],
  );
  assert.deepEqual(
    more.map(({ title }) => title),
    ["Display"],
  );
});

test("a number has its range, unit and default", () => {
  const { kind, label, unit, least, most, fallback } = field("LensArray", "offset_mm");
  assert.deepEqual(
    { kind, label, unit, least, most, fallback },
    { kind: "number", label: "Offset", unit: "mm", least: -1e6, most: 1e6, fallback: 40 },
  );
});

test("each shape of a schema has its kind", () => {
  const kinds = [
    ["LensArray", "count", "tuple"],
    ["LensArray", "lattice", "choice"],
    ["Rig", "device", "object"],
    ["Rig", "imaging_lens", "union"],
    ["RenderSettings", "antialias", "union"],
    ["RenderSettings", "tiles", "union"],
    ["Capture", "channels", "set"],
    ["Capture", "depth", "flag"],
    ["JobSpec", "outputs", "list"],
    ["JobSpec", "parameters", "map"],
    ["JobSpec", "slots", "number"],
    ["WorkerRequirement", "tags", "values"],
    ["Prescription", "surfaces", "list"],
    ["ViewsVideo", "filter", "choice"],
    ["StageChange", "location", "tuple"],
  ];
  for (const [owner, name, kind] of kinds) assert.equal(field(owner, name).kind, kind, `${owner}.${name}`);
  assert.equal(field("Rig", "device").isOptional, true);
  assert.deepEqual(field("ViewsVideo", "filter").choices, ["bicubic", "box", "triangle", "mitchell", "lanczos3"]);
});

test("a value tells which form of a union it has, and a form begins with what it requires", () => {
  const { forms } = field("Rig", "imaging_lens");
  const prescription = { surfaces: [] };
  const chosen = ["athineos-2006", { name: "x", focal_length_mm: 50 }, prescription].map((one) => formWith(forms, one));
  assert.deepEqual(
    chosen.map(({ label }) => label),
    ["by name", "Named lens", "Prescription"],
  );
  assert.equal(formWith(forms, null), undefined);
  for (const form of forms) assert.equal(formWith(forms, startOf(form)), form);
  assert.equal(startOf(forms[2]).surfaces.length, 2);
});

test("every kind of output begins as an object of its kind, without its tag among the fields", () => {
  const { forms } = field("JobSpec", "outputs");
  assert.equal(forms.length, JOB.properties.outputs.items.oneOf.length);
  for (const form of forms) {
    assert.deepEqual(startOf(form), { kind: form.tag });
    assert.equal(formWith(forms, { kind: form.tag }), form);
    assert.ok(form.help && !form.fields.some(({ name }) => name === "kind"));
  }
});

test("a value that is put at a path is found there, and removing it leaves nothing behind", () => {
  const job = { scene: "fish", rig: { px_per_lens: 8 } };
  const changed = withValue(job, "rig.lens_array.offset_mm", -5.5);
  assert.equal(valueAt(changed, "rig.lens_array.offset_mm"), -5.5);
  assert.deepEqual(withValue(changed, "rig.lens_array.offset_mm", undefined), job);
  assert.deepEqual(job, { scene: "fish", rig: { px_per_lens: 8 } });
  const outputs = { outputs: [{ kind: "views" }, { kind: "print" }] };
  assert.deepEqual(withValue(outputs, "outputs.0", undefined), { outputs: [{ kind: "print" }] });
  assert.deepEqual(withValue(outputs, "outputs.1.dpi", 600).outputs[1], { kind: "print", dpi: 600 });
  assert.equal(valueAt(job, "rig.device.dpi"), undefined);
});

test("a number is a number, another text stays what it is, and an empty one is the default", () => {
  assert.deepEqual(["8", " 1e3 ", "far", " "].map(numberOf), [8, 1000, "far", undefined]);
  assert.deepEqual(numbersOf("1, 2 x"), [1, 2, "x"]);
  assert.deepEqual([textOf([1, 2]), textOf(null), textOf(0)], ["1, 2", "", "0"]);
});

test("a job file is the same after the way to JSON and back", () => {
  const job = { scene: "fish", rig: { lens_array: { count: [10, 12] } }, outputs: ["views.mp4"] };
  assert.deepEqual(jobOfJson(jsonOf(job)), { job });
  assert.match(jobOfJson("{").fault, /not JSON/);
  assert.match(jobOfJson("[]").fault, /object/);
});

test("a stored job becomes a short job file: keyframes in their place, defaults and nulls left out", () => {
  const defaults = Object.fromEntries(fieldsOf(JOB, JOB).map(({ name, fallback }) => [name, fallback]));
  const rig = { ...JOB.properties.rig.default, imaging_lens: null, device: null };
  const stored = {
    scene: "fish",
    title: "",
    frames: "1-4",
    slots: null,
    priority: 50,
    capture: { ...defaults.capture },
    rig,
    animation: {
      "rig.lens_array.offset_mm": {
        keyframes: [
          [1, 60],
          [4, -10],
        ],
        interpolation: "linear",
      },
    },
  };
  const file = jobFileOf(stored, defaults);
  assert.deepEqual(Object.keys(file), ["scene", "frames", "rig"]);
  assert.equal(file.rig.imaging_lens, null);
  assert.ok(!("device" in file.rig));
  assert.deepEqual(file.rig.lens_array.offset_mm.keyframes, [
    [1, 60],
    [4, -10],
  ]);
});

test("an error stands at its field, inside it, or with its name above the form", () => {
  const faults = [
    { field: "rig.lens_array.count.0", expected: "at least 1", got: "0" },
    { field: "rig.device", expected: "a device", got: "7" },
    { field: "nonsense", expected: "no field of this name", got: "1" },
  ];
  assert.deepEqual(faultsAt(faults, "rig.lens_array.count"), ["expected at least 1, got 0"]);
  assert.deepEqual(faultsAt(faults, "rig", ["rig.lens_array"]), ["expected a device, got 7"]);
  assert.deepEqual(otherFaults(faults, ["rig"]), ["nonsense: expected no field of this name, got 1"]);
  assert.ok(hasFault(faults, ["scene", "rig.device"]) && !hasFault(faults, ["rig.dev"]));
});

test("two values are the same whatever the order of their names", () => {
  assert.ok(isSame({ a: 1, b: [2] }, { b: [2], a: 1 }) && !isSame({ a: 1 }, { a: 1, b: 2 }) && !isSame(null, {}));
});

test("the model of each output is in the reference", () => {
  for (const { model: name } of field("JobSpec", "outputs").forms) assert.ok(model(name).properties);
});

test("a parameter is called by its name without its unit, and never by nothing", () => {
  const named = [
    ["water_depth_mm", "mm"],
    ["mm", "mm"],
    ["_", null],
    ["ripple", "mm"],
  ];
  assert.deepEqual(
    named.map((one) => parameterTitle(...one)),
    ["Water depth", "Mm", "_", "Ripple"],
  );
});
