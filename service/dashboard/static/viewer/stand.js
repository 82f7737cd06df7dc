// The state of the viewer: what is shown of a frame, and from where. All of it is in the address, so that a link shows
// the same pixels.
import { EYES_APART_MM, LEAST_APART_MM, MOST_APART_MM } from "./painting/stereo.js";
import { FIT, MOST } from "./hand/zoom.js";

export const START = {
  frame: null, // the number of the frame; null shows the newest
  mode: "look",
  place: null, // the place of the eye among the views, see motion.js; null while the pointer or the sway moves it
  isSmooth: true,
  depth_mm: null,
  eye: { x: 0, y: 0, z: null }, // of the observer, mm
  eyes: "one",
  apart_mm: EYES_APART_MM,
  pupil_mm: 4,
  focus_mm: 0, // the depth on which the observer focuses
  gap: "focal", // "focal", "real", "virtual", or "own" for gap_mm
  gap_mm: null,
  showsDepth: false,
  sheet: "orthoscopic",
  zoom: FIT,
};

const DIGITS = 5; // Places and parts of a picture have so many, and the stand is rounded to them.
export const rounded = (number, digits = DIGITS) => Number(number.toFixed(digits));
export const roundedPlace = ({ x, y }) => ({ x: rounded(x), y: rounded(y) });

const word = (name, allowed) => ({
  name,
  from: (text) => (allowed === undefined || allowed.includes(text) ? text : undefined),
  to: String,
});
const number = (name, low, high) => ({
  name,
  from: (text) => {
    const value = text.trim() === "" ? NaN : Number(text);
    return value >= low && value <= high ? value : undefined;
  },
  to: (value) => String(rounded(value)),
});
const whole = (name, low, high) => ({
  ...number(name, low, high),
  from: (text) => (/^\d{1,9}$/.test(text) && Number(text) >= low && Number(text) <= high ? Number(text) : undefined),
});
// For every value of the query: where it stands in the state. Parts of one group are read together or not at all.
const FAR = 1e6;
const FIELDS = [
  { path: "frame", ...whole("frame", 1, 1e9) },
  { path: "mode", ...word("look", ["look", "focus", "observer", "sheet"]) },
  { path: "place.x", ...number("x", -1, 1) },
  { path: "place.y", ...number("y", -1, 1) },
  { path: "isSmooth", name: "pixels", from: (text) => text !== "1", to: (is) => (is ? undefined : "1") },
  { path: "depth_mm", ...number("depth", -FAR, FAR) },
  { path: "eye.x", ...number("right", -FAR, FAR) },
  { path: "eye.y", ...number("up", -FAR, FAR) },
  { path: "eye.z", ...number("away", 1, FAR) },
  { path: "eyes", ...word("eyes", ["one", "anaglyph", "side_by_side", "cross_eyed"]) },
  { path: "apart_mm", ...number("apart", LEAST_APART_MM, MOST_APART_MM) },
  { path: "pupil_mm", ...number("pupil", 0.1, 100) },
  { path: "focus_mm", ...number("focused", -FAR, FAR) },
  { path: "gap", ...word("gap", ["focal", "real", "virtual", "own"]) },
  { path: "gap_mm", ...number("gapmm", 0.01, 1000) },
  { path: "showsDepth", name: "map", from: (text) => text === "1", to: (is) => (is ? "1" : undefined) },
  { path: "sheet", ...word("sheet", ["orthoscopic", "integral", "views"]) },
  { path: "zoom.scale", ...number("zoom", 1, MOST) },
  { path: "zoom.x", ...number("zx", 0, 1) },
  { path: "zoom.y", ...number("zy", 0, 1) },
];

// The state that a query describes. A value that is missing or wrong is the one of the start.
export function fromQuery(query) {
  const stand = structuredClone(START);
  for (const { path, ...field } of FIELDS) {
    const text = query.get(field.name);
    const value = text === null ? undefined : field.from(text);
    if (value === undefined) continue;
    const [name, part] = path.split(".");
    if (part) stand[name] = { ...(stand[name] ?? { x: 0, y: 0 }), [part]: value };
    else stand[name] = value;
  }
  return stand;
}

// The patch of the query that describes a state; what is as at the start is not in the address.
export function toPatch(stand) {
  return Object.fromEntries(
    FIELDS.map(({ path, ...field }) => {
      const [name, part] = path.split(".");
      const [value, start] = [stand, START].map((each) => (part ? each[name]?.[part] : each[name]));
      const isStart = value === undefined || value === null || value === start;
      return [field.name, isStart ? undefined : field.to(value)];
    }),
  );
}
