// The turn of a stage about the point that it looks at, around its upward direction. Pure: no DOM.

const minus = (a, b) => a.map((one, place) => one - b[place]);
const dot = (a, b) => a.reduce((sum, one, place) => sum + one * b[place], 0);
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const scaled = (a, factor) => a.map((one) => one * factor);
const plus = (...all) => all.reduce((sum, one) => sum.map((part, place) => part + one[place]));
const unit = (a) => scaled(a, 1 / Math.sqrt(dot(a, a)));
const RAD = Math.PI / 180;

// The location after a turn by Rodrigues' formula, rounded to a hundred-thousandth of the distance.
export function turned({ location, look_at, up }, deg) {
  const [axis, arm] = [unit(up), minus(location, look_at)];
  const [cos, sin] = [Math.cos(deg * RAD), Math.sin(deg * RAD)];
  const moved = plus(scaled(arm, cos), scaled(cross(axis, arm), sin), scaled(axis, dot(axis, arm) * (1 - cos)));
  const places = 5 - Math.floor(Math.log10(Math.sqrt(dot(arm, arm))));
  return plus(look_at, moved).map((one) => Number(one.toFixed(Math.min(100, Math.max(0, places)))) + 0);
}

// The turn of a location from that of the stage, in whole degrees.
export function angleOf({ location, look_at, up }, now) {
  const axis = unit(up);
  const flat = (point) => {
    const arm = minus(point, look_at);
    return minus(arm, scaled(axis, dot(axis, arm)));
  };
  const [from, to] = [flat(location), flat(now)];
  return Math.round(Math.atan2(dot(axis, cross(from, to)), dot(from, to)) / RAD) + 0;
}
