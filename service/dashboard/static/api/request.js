// The result of the latest request. Earlier requests are aborted; their result stays until the next one arrives.
import { useEffect, useRef, useState } from "preact/hooks";
import { Unreachable } from "./operations.js";

const AGAIN_MS = 3000; // The interval of retries while the service does not answer.

// `question` identifies the request, null means none; `ask(signal)` sends it. Returns {value, fault, isWaiting}. Of
// requests in quick succession only the last is sent, `pause_ms` after it.
export function useRequest(question, ask, pause_ms = 0) {
  const [found, setFound] = useState({ value: null, fault: "", isAway: false, isWaiting: false });
  const [round, setRound] = useState(0);
  const value = useRef(null);
  value.current = found.value;
  useEffect(() => {
    if (question === null) return undefined;
    const asked = new AbortController();
    setFound((before) => ({ ...before, isWaiting: true }));
    const put = (answer) => asked.signal.aborted || setFound({ fault: "", isAway: false, isWaiting: false, ...answer });
    const fail = (error) => put({ value: value.current, fault: error.message, isAway: error instanceof Unreachable });
    const timer = setTimeout(() => ask(asked.signal).then((answer) => put({ value: answer }), fail), pause_ms);
    return () => {
      clearTimeout(timer);
      asked.abort();
    };
  }, [question, round]);
  useEffect(() => {
    if (!found.isAway || found.isWaiting) return undefined;
    const timer = setTimeout(() => setRound((before) => before + 1), AGAIN_MS);
    return () => clearTimeout(timer);
  }, [found]);
  return found;
}
