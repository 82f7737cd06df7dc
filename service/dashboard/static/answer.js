// What a question brings. The last one wins: what was asked before is given up, and its answer stays until the next.
import { useEffect, useRef, useState } from "preact/hooks";
import { useKnown } from "./store.js";

// `question` is a text, null for none; `ask(signal)` brings its answer. Returns {value, fault, isWaiting}. Questions in
// quick succession are asked `pause_ms` after the last of them; after a fault, again when the service is back.
export function useAnswer(question, ask, pause_ms = 0) {
  const [found, setFound] = useState({ value: null, fault: "", isWaiting: false });
  const [round, setRound] = useState(0);
  const link = useKnown((known) => known.link);
  const last = useRef(found);
  last.current = found;
  useEffect(() => {
    if (link === "live" && last.current.fault) setRound((before) => before + 1);
  }, [link]);
  useEffect(() => {
    if (question === null) return undefined;
    const asked = new AbortController();
    setFound((before) => ({ ...before, isWaiting: true }));
    const put = (answer) => !asked.signal.aborted && setFound({ fault: "", isWaiting: false, ...answer });
    const timer = setTimeout(
      () => ask(asked.signal).then(
        (value) => put({ value }),
        (error) => put({ value: last.current.value, fault: error.message }),
      ),
      last.current.value ? pause_ms : 0,
    );
    return () => {
      clearTimeout(timer);
      asked.abort();
    };
  }, [question, round]);
  return found;
}
