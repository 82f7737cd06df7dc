// The scroll position of a page: a new page begins at its top, and Back and Forward return to where the user was.

const WAIT_MS = 5000; // The time in which a page loads what makes it long.
const HANDS = ["wheel", "touchstart", "pointerdown", "keydown"]; // The user scrolls, and nothing is restored any more.

let goal_px = null; // The position that is being restored.
let timer = null;

export function start() {
  history.scrollRestoration = "manual";
  goal_px = history.state?.scroll_px ?? null;
  addEventListener("scroll", () => (timer ??= setTimeout(keep, 150)), { passive: true });
  addEventListener("popstate", ({ state }) => (goal_px = state?.scroll_px || null));
  for (const event of HANDS) addEventListener(event, () => (goal_px = null), { passive: true });
}

// Called after another page has been drawn; returns a function that ends the restoration.
export function arrive() {
  const from = goal_px;
  scrollTo(0, from ?? 0);
  if (from === null) return undefined;
  const grown = new ResizeObserver(() => goal_px === from && scrollTo(0, from));
  grown.observe(document.body);
  const end = setTimeout(() => {
    grown.disconnect();
    if (goal_px === from) goal_px = null;
  }, WAIT_MS);
  return () => {
    grown.disconnect();
    clearTimeout(end);
  };
}

function keep() {
  timer = null;
  if (goal_px === null) history.replaceState({ ...history.state, scroll_px: scrollY }, "");
}
