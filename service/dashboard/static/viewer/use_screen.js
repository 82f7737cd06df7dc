// What the viewer knows of its surroundings: its size, the full screen, and whether the user wants motion.
import { useEffect, useLayoutEffect, useState } from "preact/hooks";

// The size of a part of an element in px.
export function useSize(box, selector) {
  const [size, setSize] = useState({ width: 1, height: 1 });
  useLayoutEffect(() => {
    const node = box.current.querySelector(selector);
    const measure = () => setSize({ width: Math.max(1, node.clientWidth), height: Math.max(1, node.clientHeight) });
    measure();
    const resized = new ResizeObserver(measure);
    resized.observe(node);
    return () => resized.disconnect();
  }, []);
  return size;
}

// Where a browser has no full screen, for example on an iPhone, the element fills the window.
export function useFullScreen(box) {
  const [isFilling, setFilling] = useState(false);
  const [isFull, setFull] = useState(false);
  useEffect(() => {
    const follow = () => setFull(document.fullscreenElement === box.current);
    document.addEventListener("fullscreenchange", follow);
    return () => document.removeEventListener("fullscreenchange", follow);
  }, []);
  const isOn = isFull || isFilling;
  useEffect(() => {
    if (!isFilling) return undefined;
    const leave = (event) => event.key === "Escape" && setFilling(false);
    addEventListener("keydown", leave);
    return () => removeEventListener("keydown", leave);
  }, [isFilling]);
  const toggle = () => {
    if (isFull) document.exitFullscreen();
    else if (isFilling) setFilling(false);
    else if (box.current.requestFullscreen) box.current.requestFullscreen().catch(() => setFilling(true));
    else setFilling(true);
  };
  return { isOn, toggle };
}

// Whether the user asks for no motion.
export function useMotionPreference() {
  const query = matchMedia("(prefers-reduced-motion: reduce)");
  const [isCalm, setCalm] = useState(query.matches);
  useEffect(() => {
    const follow = () => setCalm(query.matches);
    query.addEventListener("change", follow);
    return () => query.removeEventListener("change", follow);
  }, []);
  return isCalm;
}
