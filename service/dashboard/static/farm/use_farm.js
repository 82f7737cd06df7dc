// What the page of the farm shows, renewed with the events of jobs and the health of the farm: it has no own stream.
import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { nowMs } from "../api/clock.js";
import { getFarm, getFarmHistory, getFarmOwners, getWorkers } from "../api/operations.js";
import { useKnown } from "../state/store.js";

const PAUSE_MS = 2000; // Events in quick succession renew the page once.
const SLOW_MS = 60_000; // Sums over all jobs are renewed more rarely.

// Returns {workers, excluded, known, work, at_s, fault, renew}; `work` is null until the first answer.
export function useFarm() {
  const [found, setFound] = useState({ workers: [], excluded: [], known: true, work: null, at_s: 0, fault: "" });
  const [jobs, health] = [useKnown((known) => known.jobs), useKnown((known) => known.health)];
  const timer = useRef(null);
  const last = useRef(0);
  const renew = useCallback(async () => {
    timer.current = null;
    last.current = Date.now();
    try {
      const [list, work] = await Promise.all([getWorkers(), getFarm()]);
      const { items: workers, excluded, known } = list;
      setFound({ workers, excluded, known, work, at_s: nowMs() / 1000, fault: "" });
    } catch (error) {
      setFound((before) => ({ ...before, fault: error.message }));
    }
  }, []);
  useEffect(() => {
    timer.current ??= setTimeout(renew, Math.max(0, last.current + PAUSE_MS - Date.now()));
  }, [jobs, health]);
  useEffect(() => () => clearTimeout(timer.current), []);
  return { ...found, renew };
}

// Returns {value, fault} of a request that is sent again every minute, and when `key` changes.
function useRenewed(ask, key) {
  const [found, setFound] = useState({ value: null, fault: "" });
  useEffect(() => {
    let isOver = false;
    const put = (news) => isOver || setFound((before) => ({ ...before, ...news }));
    const load = () =>
      ask().then(
        (value) => put({ value, fault: "" }),
        (error) => put({ fault: error.message }),
      );
    load();
    const timer = setInterval(load, SLOW_MS);
    return () => {
      isOver = true;
      clearInterval(timer);
    };
  }, [key]);
  return found;
}

export const useHistory = (hours) => useRenewed(() => getFarmHistory(hours), hours);
export const useOwners = () => useRenewed(getFarmOwners, "");
