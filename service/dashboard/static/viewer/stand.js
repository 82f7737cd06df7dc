// The state of the viewer: what is shown of a frame, and from where.

export const START = {
  place: null, // the position of the eye among the views; see views.js
  isSwaying: !matchMedia("(prefers-reduced-motion: reduce)").matches,
  isSmooth: true,
  depth_mm: null,
  eye: { x: 0, y: 0, z: null }, // mm
  eyes: "one",
};
