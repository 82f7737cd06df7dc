// What the service says to a job while somebody writes it: the fields at fault, the design, and the use of limits.
import { useEffect, useState } from "preact/hooks";
import { postCheck, postDesign, postDrawing } from "../api/operations.js";

// The pause after the last change, so that no request is sent for every digit; a slider should still be followed.
const PAUSE_MS = 150;

/**
 * `numbers` and `drawing` are those of the last job that had a design; `faults` are the fields at fault, `problem` says
 * why there is no design, and `checked` is the job, as JSON, to which all of it belongs.
 * @typedef {{
 *   numbers?: any, drawing?: string, limits?: any[], faults: any[], problem: any, isStale: boolean, checked: string,
 * }} Found
 */

/** @type {Found} */
const NOTHING = { isStale: true, problem: null, faults: [], checked: "" };

// The design of a stored job.
export const useDesign = (spec) => useAnswers(spec, askDesign);

// An error in the job is an answer here, so that writing a wrong value leaves no failed request.
export const useCheck = (job) => useAnswers(job, askCheck, NO_LIMITS);

// The limits have their place before they come.
const NO_LIMITS = { limits: [] };

async function askDesign(spec, put) {
  const [numbers, drawing] = await Promise.all([postDesign(spec), postDrawing(spec)]);
  put({ numbers, drawing, isStale: false, problem: null });
}

async function askCheck(job, put) {
  const { detail, errors: faults, design, limits } = await postCheck(job);
  const about = { faults, limits, checked: JSON.stringify(job) };
  if (detail) return put({ ...about, isStale: true, problem: { message: detail } });
  put({ ...about, numbers: design ?? undefined, isStale: design !== null, problem: null });
  // Imported integral images have no design.
  return put({ drawing: design ? await postDrawing(job) : undefined, isStale: false });
}

/** @returns {Found} */
function useAnswers(spec, ask, first = {}) {
  const [found, setFound] = useState({ ...NOTHING, ...first });
  const question = JSON.stringify(spec);
  useEffect(() => {
    let isWanted = true;
    const put = (patch) => isWanted && setFound((before) => ({ ...before, ...patch }));
    const failed = (problem) => put({ isStale: true, problem, faults: problem.fields || [] });
    const timer = setTimeout(() => ask(spec, put).catch(failed), PAUSE_MS);
    put({ isStale: true });
    return () => {
      isWanted = false;
      clearTimeout(timer);
    };
  }, [question]);
  return found;
}
