// The groups of the form for a new job: which field of the job file stands where. Pure: no DOM.
import { pageOf } from "./documentation.js";
import { fieldsOf } from "./schema.js";

// A field belongs to the group with the longest path above it. The fields of `first` are always shown, in this order;
// the others are below "More".
const GROUPS = [
  { name: "scene", title: "Scene", paths: ["scene", "title", "parameters", "stage"], first: ["title"] },
  { name: "time", title: "Time", paths: ["frames", "fps", "clock"], first: ["frames", "fps"] },
  {
    name: "optics",
    title: "Optics",
    paths: ["rig", "capture"],
    sliders: true,
    first: [
      "rig.lens_array.count",
      "rig.px_per_lens",
      "rig.lens_array.pitch_mm",
      "rig.lens_array.offset_mm",
      "rig.lens_array.focal_length_mm",
      "rig.imaging_lens",
    ],
  },
  {
    name: "display",
    title: "Display",
    paths: ["rig.device", "display"],
    first: ["rig.device", "display.viewing_distance_mm"],
  },
  { name: "outputs", title: "Outputs", paths: ["outputs"], first: ["outputs"] },
  { name: "farm", title: "Farm", paths: [], first: ["priority"] },
];

// Fields with a place of their own on the page: the scene and its parameters are chosen from pictures, and keyframes
// stand in place of the number that they animate.
const ELSEWHERE = new Set(["scene", "parameters", "animation"]);

// Returns [{name, title, first: [field], more: [{title, model, fields}]}]; each field has its `path` and the `model`
// that the API reference describes it in.
export function groupsOf(schema) {
  const leaves = fieldsOf(schema, schema).flatMap((field) => leavesOf(field, "", { label: "", model: "JobSpec" }));
  const shown = leaves.filter(({ path }) => !ELSEWHERE.has(path));
  return GROUPS.map(({ name, title, first, sliders }) => {
    const mine = shown.filter(({ path }) => groupOf(path) === name);
    const known = first.map((path) => mine.find((field) => field.path === path)).filter(Boolean);
    const main = sliders ? known.map((field) => ({ ...field, slider: spanOf(field) })) : known;
    return { name, title, first: main, more: sections(mine.filter((field) => !known.includes(field))) };
  });
}

// The range of a slider: around the default, and within that of the field, which may reach a kilometre.
export function spanOf({ kind, fallback, least, most, isInteger }) {
  if (kind !== "number" || !fallback) return null;
  const span = 2 * Math.abs(fallback);
  const from = Math.max(least ?? -Infinity, fallback - span);
  // The least value is often 0, and is not allowed itself.
  return { least: from || Math.abs(fallback) / 10, most: Math.min(most ?? Infinity, fallback + span), isInteger };
}

// Objects that every job has are taken apart; an object that may be absent is one field.
function leavesOf(field, above, owner) {
  const path = above ? `${above}.${field.name}` : field.name;
  if (field.kind === "object" && !field.isOptional) {
    return field.fields.flatMap((inner) => leavesOf(inner, path, field));
  }
  return [{ ...field, path, more: pageOf(path), section: owner.label, owner: owner.model }];
}

function groupOf(path) {
  const isAbove = (above) => path === above || path.startsWith(`${above}.`);
  const found = GROUPS.flatMap(({ name, paths }) => paths.filter(isAbove).map((above) => ({ name, above })));
  return found.sort((a, b) => b.above.length - a.above.length)[0]?.name || "farm";
}

function sections(fields) {
  const titles = [...new Set(fields.map(({ section }) => section))];
  return titles.map((title) => {
    const mine = fields.filter(({ section }) => section === title);
    return { title, model: mine[0].owner, fields: mine };
  });
}
