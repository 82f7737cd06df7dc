// The place of the control that takes the focus after the one at a place has gone: the next one that is ready, or else
// the one before it; -1 if none is. `ready` says of each control whether it is.
export function placeAfter(ready, at) {
  const from = Math.max(0, Math.min(at, ready.length));
  const after = ready.indexOf(true, from);
  return after >= 0 ? after : ready.lastIndexOf(true);
}
