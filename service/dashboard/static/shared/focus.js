// Keeps the focus of the keyboard on the page. When a control goes that has it, because it was removed, hidden or
// disabled, the next control near it gets the focus, and after a change of the page its main part.
import { placeAfter } from "./focus_place.js";

const CONTROLS = "a[href], button, input, select, textarea, summary, [tabindex]";
const PAUSE_MS = 60; // What takes the place of a control is drawn by then.
const PATIENCE = 20; // Pauses for which a control that is disabled while it works is waited for.

let last = null; // {node, around: [{node, at}]}: the control, and its place among the controls of each part around it
let waits = 0;
let timer = null;

export function start() {
  document.addEventListener("focusin", ({ target }) => {
    last = { node: target, around: partsAround(target) };
    waits = 0;
  });
  const look = () => (timer ??= setTimeout(check, PAUSE_MS));
  const attributeFilter = ["disabled", "open", "hidden"];
  new MutationObserver(look).observe(document.body, { subtree: true, childList: true, attributeFilter });
}

const controlsIn = (part) => [...part.querySelectorAll(CONTROLS)];
const isReady = (node) => node.isConnected && !node.matches(":disabled") && node.checkVisibility();

function partsAround(target) {
  const parts = [];
  for (let node = target.parentElement; node && node !== document.body; node = node.parentElement)
    parts.push({ node, at: controlsIn(node).indexOf(target) });
  return parts;
}

function check() {
  timer = null;
  if (!last || document.activeElement !== document.body) return;
  if (isReady(last.node)) {
    if (waits > 0) last.node.focus(); // It is enabled again.
    return;
  }
  if ((last.node.isConnected || isWorking()) && ++waits < PATIENCE) {
    timer = setTimeout(check, PAUSE_MS);
    return;
  }
  waits = 0;
  nearest()?.focus({ preventScroll: true });
}

// Whether all controls that took the place of the one that went are disabled while something works.
function isWorking() {
  const part = last.around.find(({ node }) => node.isConnected);
  const shown = part ? controlsIn(part.node).filter((one) => one.checkVisibility()) : [];
  return shown.length > 0 && shown.every((one) => one.matches(":disabled"));
}

function nearest() {
  const main = document.querySelector("[role=main]");
  for (const { node, at } of last.around) {
    if (node === main) break;
    if (!node.isConnected) continue;
    const controls = controlsIn(node);
    const place = placeAfter(
      controls.map((one) => isReady(one) && one.tabIndex >= 0),
      at,
    );
    if (place >= 0) return controls[place];
  }
  if (main && !main.hasAttribute("tabindex")) main.setAttribute("tabindex", "-1");
  return main;
}
