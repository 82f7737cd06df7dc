// Fields of a form, from a JSON schema. Pure: no DOM.
//
// A field is {name, kind, label, unit, help, fallback, isOptional, model} and, by its kind:
//   number  isInteger, least, most      text   examples         flag     -
//   choice  choices                     set    choices          values   isNumber (a list of texts or numbers)
//   tuple   items                       object fields, required map      -
//   union   forms (fields; one of them has the shape of the value)
//   list    forms (objects; each item is of the form with its `tag`)
// `fallback` is the default; `isOptional` fields may be null; `model` is the name of the schema in the API reference.

const REF = /^#\//;

function resolve(root, schema) {
  if (!schema.$ref) return [schema, ""];
  const way = schema.$ref.replace(REF, "").split("/");
  const { $ref: _, ...beside } = schema;
  return [{ ...way.reduce((place, name) => place[name], root), ...beside }, way.at(-1)];
}

// The field that a schema describes.
export function fieldOf(root, name, given) {
  const [schema, model] = resolve(root, given);
  const alternatives = flat(root, schema);
  const kept = alternatives.filter(({ type }) => type !== "null");
  const about = {
    name,
    model,
    label: schema.title || name,
    unit: schema.unit || "",
    help: line(schema.description),
    fallback: schema.default ?? null,
    isOptional: kept.length < alternatives.length,
  };
  if (!alternatives.length) return { ...about, ...kindOf(root, schema) };
  const choices = kept.flatMap(choicesOf);
  if (kept.every((one) => choicesOf(one).length)) return { ...about, kind: "choice", choices };
  const forms = kept.map((one, place) => formOf(root, one, place));
  if (forms.length > 1) return { ...about, kind: "union", forms: forms.map((form) => withExamples(form, schema)) };
  const { name: _, label, help, fallback, isOptional, unit, ...rest } = withExamples(forms[0], schema);
  return { ...about, help: about.help || help, ...rest };
}

// Fields of an object, in the order of the schema.
export const fieldsOf = (root, schema) =>
  Object.entries(resolve(root, schema)[0].properties || {})
    .filter(([, about]) => resolve(root, about)[0].const === undefined)
    .map(([name, about]) => fieldOf(root, name, about));

function flat(root, schema) {
  const some = schema.anyOf || schema.oneOf || [];
  return some.flatMap((one) => {
    const [inner] = resolve(root, one);
    return inner.anyOf || inner.oneOf ? flat(root, inner) : [one];
  });
}

const choicesOf = (schema) => schema.enum || (schema.const === undefined ? [] : [schema.const]);
const withExamples = (field, { examples }) => (field.kind === "text" && examples ? { ...field, examples } : field);

function formOf(root, schema, place) {
  const field = fieldOf(root, String(place), schema);
  const title = resolve(root, schema)[0].title;
  return { ...field, label: field.model ? spaced(title || field.model) : TITLES[field.kind] || field.kind };
}

const TITLES = { text: "by name", tuple: "numbers", number: "number" };

function kindOf(root, schema) {
  if (choicesOf(schema).length) return { kind: "choice", choices: choicesOf(schema) };
  if (schema.type === "boolean") return { kind: "flag" };
  if (schema.type === "number" || schema.type === "integer") return { kind: "number", ...range(schema) };
  if (schema.type === "array") return listKind(root, schema);
  if (schema.properties) {
    const required = schema.required || [];
    return { kind: "object", fields: fieldsOf(root, schema), required, help: line(schema.description) };
  }
  if (schema.type === "object") return { kind: "map" };
  return { kind: "text", examples: schema.examples || [] };
}

function listKind(root, schema) {
  if (schema.prefixItems) {
    return { kind: "tuple", items: schema.prefixItems.map((item, place) => fieldOf(root, String(place), item)) };
  }
  const [item] = resolve(root, schema.items);
  const few = schema.minItems || 0;
  if (choicesOf(item).length) return { kind: "set", choices: choicesOf(item) };
  if (item.type && item.type !== "object") return { kind: "values", isNumber: item.type !== "string" };
  const some = item.oneOf || item.anyOf || [schema.items];
  return { kind: "list", few, forms: some.map((one) => taggedForm(root, one)) };
}

// An item of a list: its tag is the value of `kind`, or nothing.
function taggedForm(root, given) {
  const [schema, model] = resolve(root, given);
  const tag = schema.properties?.kind?.const ?? "";
  const label = tag ? tag.replaceAll("_", " ") : spaced(schema.title || model).toLowerCase();
  const fields = fieldsOf(root, given);
  return {
    kind: "object",
    name: tag,
    tag,
    label,
    model,
    help: line(schema.description),
    fields,
    required: schema.required || [],
  };
}

const range = (schema) => ({
  isInteger: schema.type === "integer",
  least: schema.minimum ?? schema.exclusiveMinimum ?? null,
  most: schema.maximum ?? schema.exclusiveMaximum ?? null,
  examples: schema.examples || [],
});

// Descriptions are wrapped where the source is; paragraphs after the first one are for the reference.
const line = (text = "") => text.split("\n\n")[0].replaceAll("\n", " ");
export const spaced = (title) =>
  title.replace(/(?<=[a-z0-9])(?=[A-Z])/g, " ").replace(/ [A-Z]/g, (c) => c.toLowerCase());

// The name of a parameter of a scene without its unit, which stands beside it; a name that is only a unit stays.
export function parameterTitle(name, unit) {
  const words = name.split("_").filter((word) => word && word !== unit);
  const text = words.join(" ") || name;
  return text[0].toUpperCase() + text.slice(1);
}

// The form of a union or of a list that a value has; undefined if it has none.
export function formWith(forms, value) {
  if (value === null || value === undefined) return undefined;
  const fits = forms.filter((form) => hasShape(form, value));
  return fits.length > 1 ? fits.find(({ tag }) => tag && tag === value.kind) || fits[0] : fits[0];
}

function hasShape(form, value) {
  if (form.tag) return value.kind === form.tag;
  if (form.kind === "object") {
    return isObject(value) && !value.keyframes && form.required.every((name) => name in value);
  }
  if (form.kind === "tuple" || form.kind === "values") return Array.isArray(value);
  if (form.kind === "choice") return form.choices.includes(value);
  return form.kind === "number" ? typeof value === "number" : typeof value === "string";
}

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

// A value with which a form begins: only what it requires.
export function startOf(form) {
  if (form.kind === "object") {
    const needed = form.fields.filter(({ name }) => form.required.includes(name));
    const start = Object.fromEntries(needed.map((field) => [field.name, startOf(field)]));
    return form.tag ? { kind: form.tag, ...start } : start;
  }
  if (form.isOptional) return null;
  if (form.fallback !== null) return form.fallback;
  if (form.kind === "tuple") return form.items.map(startOf);
  if (form.kind === "list") return Array.from({ length: form.few }, () => startOf(form.forms[0]));
  if (form.kind === "choice") return form.choices[0];
  if (form.kind === "number") return form.examples[0] ?? Math.max(1, form.least ?? 1);
  return form.examples?.[0] ?? "";
}
