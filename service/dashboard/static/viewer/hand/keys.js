// The keys of the viewer.
//   arrows  turn the scene, or steer the mode     + - 0  zoom     Shift and arrows  move the enlarged picture
//   Page Up, Page Down  other frames     Space  play     1 2 3 4  modes     F  full screen
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const TYPED = "input:not([type=radio], [type=checkbox], [type=range]), select, textarea";
const CONTROLS = "input, select, button, a, summary";
const THEIRS = [" ", "PageUp", "PageDown", ...Object.keys(ARROWS)]; // Controls have these keys for themselves.
const ZOOM_STEP = 1.25;

// Returns what is done when a key is pressed, from what each key does.
export function pressed({ step, pan, zoom, fit, show, toggle, modes }) {
  const acts = {
    "+": () => zoom(ZOOM_STEP),
    "=": () => zoom(ZOOM_STEP),
    "-": () => zoom(1 / ZOOM_STEP),
    0: fit,
    PageUp: show.before,
    PageDown: show.after,
    f: toggle.fullScreen,
    " ": toggle.play,
    ...Object.fromEntries(modes.map((choose, place) => [place + 1, choose])),
  };
  return (event) => {
    if (event.target.matches(TYPED) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (THEIRS.includes(event.key) && event.target.closest(CONTROLS)) return;
    const direction = ARROWS[event.key];
    const act = direction ? () => (event.shiftKey ? pan : step)(direction) : acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  };
}
