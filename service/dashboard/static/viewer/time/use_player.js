// Plays the frames: `show(index)` shows one, `isReady(index)` says whether it is loaded, `prepare(index)` loads it.
import { useEffect, useRef, useState } from "preact/hooks";
import { ahead, ticked } from "./clock.js";

const AHEAD = 4; // The number of frames that are loaded in advance.

export function usePlayer({ index, count, show, isReady, prepare }) {
  const [isPlaying, setPlaying] = useState(false);
  const [speed_fps, setSpeed] = useState(8);
  const [isLooping, setLooping] = useState(true);
  const now = useRef(null);
  now.current = { index, count, speed_fps, isLooping, show, isReady, prepare };
  useEffect(() => {
    if (!isPlaying) return undefined;
    let since_ms = performance.now();
    let asked = requestAnimationFrame(function turn(now_ms) {
      const { show, isReady, prepare, ...clock } = now.current;
      ahead(clock, AHEAD).forEach(prepare);
      const after = ticked({ ...clock, since_ms }, now_ms, isReady);
      since_ms = after.since_ms;
      if (after.index !== clock.index) show(after.index);
      if (after.isOver) setPlaying(false);
      else asked = requestAnimationFrame(turn);
    });
    return () => cancelAnimationFrame(asked);
  }, [isPlaying]);
  const toggle = () => {
    // At the end, play begins again.
    if (!isPlaying && !isLooping && index + 1 >= count) show(0);
    setPlaying(!isPlaying);
  };
  return { isPlaying, toggle, pause: () => setPlaying(false), speed_fps, setSpeed, isLooping, setLooping };
}
