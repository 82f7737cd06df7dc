// The errors of the service, each at its field. Pure: no DOM.

const isAt = (field, path) => field === path || field.startsWith(`${path}.`);

// The texts of the errors of a field and of what is inside it, but for those inside the fields of `inner`.
export const faultsAt = (faults, path, inner = []) =>
  faults.filter(({ field }) => isAt(field, path) && !inner.some((one) => isAt(field, one))).map(textOf);

// The errors of no field of the form, with the name of their field.
export const otherFaults = (faults, paths) =>
  faults.filter(({ field }) => !paths.some((path) => isAt(field, path))).map((one) => `${one.field}: ${textOf(one)}`);

export const hasFault = (faults, paths) => faults.some(({ field }) => paths.some((path) => isAt(field, path)));

const textOf = ({ expected, got }) => `expected ${expected}, got ${got}`;
