// Pointers on the stage: a drag, a pan, a pinch, a hover or a click; and the wheel.
import { useEffect, useRef } from "preact/hooks";

const STILL_PX = 4; // A pointer that moves less clicks.
const WHEEL_PER_PX = 0.0016;

// `stage` is a ref. The functions of `does` get points {x, y} in px from the upper left corner of the stage:
//   grab(point) → (across_px, down_px) or null    release()    pan(across_px, down_px)    zoom(factor, point)
//   hover(point)    leave()    click(point)    isPanning() says whether a drag pans    hasWheel() whether it zooms
export function useGestures(stage, does) {
  const now = useRef(null);
  now.current = does;
  const pointers = useRef(new Map());
  const held = useRef(null);

  const pointOf = (event) => {
    const box = stage.current.getBoundingClientRect();
    return { x: event.clientX - box.x, y: event.clientY - box.y };
  };
  const settle = () => {
    if (held.current?.pull) now.current.release();
    held.current = null;
  };
  useEffect(() => {
    const node = stage.current;
    const turn = (event) => {
      if (!event.ctrlKey && !now.current.hasWheel()) return;
      event.preventDefault();
      const px = event.deltaMode === 1 ? event.deltaY * 16 : event.deltaY;
      now.current.zoom(Math.exp(-WHEEL_PER_PX * px * (event.ctrlKey ? 4 : 1)), pointOf(event));
    };
    node.addEventListener("wheel", turn, { passive: false });
    return () => node.removeEventListener("wheel", turn);
  }, []);

  const begin = (event) => {
    if (event.target.closest("button, a, input, select, summary")) return;
    const point = pointOf(event);
    pointers.current.set(event.pointerId, point);
    stage.current.setPointerCapture(event.pointerId);
    if (pointers.current.size > 1) {
      settle();
      return;
    }
    const pans = event.button === 1 || event.shiftKey || now.current.isPanning();
    if (event.button > 1) return;
    const pull = pans ? null : now.current.grab(point);
    held.current = { from: point, last: point, pans, pull, isClick: event.button === 0 };
  };
  const move = (event) => {
    const point = pointOf(event);
    const before = pointers.current.get(event.pointerId);
    if (!before) {
      if (event.pointerType === "mouse") now.current.hover(point);
      return;
    }
    pointers.current.set(event.pointerId, point);
    if (pointers.current.size === 2) {
      const other = [...pointers.current].find(([id]) => id !== event.pointerId)[1];
      now.current.zoom(apart(point, other) / Math.max(1, apart(before, other)), middle(point, other));
      now.current.pan((point.x - before.x) / 2, (point.y - before.y) / 2);
      return;
    }
    const hold = held.current;
    if (!hold) return;
    if (apart(point, hold.from) >= STILL_PX) hold.isClick = false;
    if (hold.pans) now.current.pan(point.x - hold.last.x, point.y - hold.last.y);
    else hold.pull?.(point.x - hold.from.x, point.y - hold.from.y);
    hold.last = point;
  };
  const end = (event) => {
    pointers.current.delete(event.pointerId);
    const hold = held.current;
    settle();
    if (hold?.isClick && event.type === "pointerup") now.current.click(pointOf(event));
  };
  return {
    onPointerDown: begin,
    onPointerMove: move,
    onPointerUp: end,
    onPointerCancel: end,
    onPointerLeave: () => now.current.leave(),
  };
}

const apart = (one, other) => Math.hypot(one.x - other.x, one.y - other.y);
const middle = (one, other) => ({ x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 });
