// The state of the viewer and the address, which always say the same.
import { useEffect, useRef, useState } from "preact/hooks";
import { read, watch, write } from "../shared/address.js";
import { fromQuery, toPatch } from "./stand.js";

const PAUSE_MS = 250; // While something moves, the address is not written for every step.

const textOf = (stand) => JSON.stringify(toPatch(stand));

// Returns {stand, change}. `change(patch, {isStep})` changes it; a step can be undone with Back.
export function useStand(job) {
  const [stand, setStand] = useState(() => fromQuery(read().query));
  const now = useRef(stand);
  const timer = useRef(null);
  now.current = stand;

  const save = () => {
    clearTimeout(timer.current);
    timer.current = null;
    if (read().id === job) write(toPatch(now.current));
  };
  const change = (patch, { isStep = false } = {}) => {
    if (isStep) save(); // The entry that is left keeps the state that it had.
    const after = { ...now.current, ...patch };
    now.current = after;
    setStand(after);
    if (isStep) write(toPatch(after), { replace: false });
    else timer.current ??= setTimeout(save, PAUSE_MS);
  };
  useEffect(() => {
    const follow = ({ type }) => {
      const here = read();
      if (here.id !== job) return;
      const isHistory = type !== "addresschange"; // Back, Forward, or a link; otherwise the newer state stays.
      if (!isHistory && timer.current !== null) return;
      clearTimeout(timer.current);
      timer.current = null;
      const there = fromQuery(here.query);
      if (textOf(there) === textOf(now.current)) return;
      now.current = there;
      setStand(there);
    };
    const end = watch(follow);
    return () => {
      clearTimeout(timer.current);
      end();
    };
  }, [job]);
  return { stand, change };
}
