// What the page of the farm says of workers and tasks. Pure: no DOM, no Preact.
import { bytes, count, duration, many } from "../shared/format.js";

const ENGINES = { povray: "POV-Ray", mitsuba: "Mitsuba", none: "no engine" };

export const engineName = (engine) => ENGINES[engine] || engine;

// The state of a worker: {word, tone, why}. `tone` is that of a badge of a job.
export function workerState(worker) {
  const rest = worker.running ? "It finishes its tasks." : "";
  if (worker.excluded) return state("excluded", "paused", `It takes no orders until an admin includes it. ${rest}`);
  if (worker.closed === "draining") {
    const how = worker.drained ? "An admin has drained it; a restart of it ends that." : "A signal has drained it.";
    return state(worker.running ? "draining" : "drained", "paused", `${how} ${rest}`);
  }
  if (worker.drained) return state("draining", "paused", "It is about to take no further orders.");
  if (worker.fault) return state("at fault", "failed", `${worker.fault}.`);
  if (worker.closed === "version") return state("other release", "failed", worker.version_note || "");
  if (worker.closed === "hours") return state("outside its hours", "paused", `Its hours are ${worker.hours}. ${rest}`);
  if (worker.not_claiming_since_s) return state("takes no orders", "failed", "It has a free slot and takes no orders.");
  if (!worker.running) return state("idle", "queued", "It takes orders and has none.");
  return state(worker.running < worker.slots ? "working" : "busy", "running", "");
}

const state = (word, tone, why) => ({ word, tone, why: why.trim() });

// What an admin may do with a worker: [[action, title, explanation]].
export function workerActions(worker) {
  if (worker.excluded) return [["include", "Include", "It takes orders again."]];
  const drain = worker.drained
    ? ["undrain", "Undo the drain", "It takes orders again."]
    : ["drain", "Drain", "It finishes its tasks and takes no further orders until it is restarted."];
  const exclude = ["exclude", "Exclude", "As a drain, but it lasts also when the worker is restarted."];
  const forgive = ["forgive", "Forgive", `Its failures are forgotten; ${avoided(worker.avoided_by)} now.`];
  const isOver = worker.closed === "draining" && !worker.drained; // by a signal, which nobody takes back
  return [...(isOver ? [] : [drain]), exclude, ...(worker.avoided_by ? [forgive] : [])];
}

export const avoided = (jobs) => (jobs === 1 ? "1 job avoids it" : `${count(jobs)} jobs avoid it`);

export function enginesOf(worker) {
  const known = Object.entries(worker.engine_versions || {});
  if (!known.length) return worker.povray === "none" ? "no engine" : `POV-Ray ${worker.povray}`;
  return known.map(([engine, version]) => `${engineName(engine)} ${version}`).join(", ");
}

export function loadOf({ load, cores }) {
  if (load === null || load === undefined) return "not known";
  return cores ? `${load.toFixed(1)} of ${many(cores, "core")}` : load.toFixed(1);
}

// Seconds as people say them: "3 s ago".
export const secondsAgo = (then_s, now_s) => `${duration(Math.max(0, now_s - then_s))} ago`;

// What a task makes: "frame 3", "frame 3, tile 1.2", "views.mp4".
export function taskPlace(task) {
  if (task.kind === "probe") return "probe";
  if (task.output) return task.output;
  const tile = task.tile ? `, tile ${task.tile.row + 1}.${task.tile.col + 1}` : "";
  return `frame ${task.frame}${task.kind === "assemble" ? ", assembly" : tile}`;
}

// The tasks of each worker, by its name; those whose orders no worker has taken are left out.
export function tasksByWorker(tasks) {
  const found = {};
  for (const task of tasks) if (task.worker) (found[task.worker] ||= []).push(task);
  return found;
}

// The figures at the top of the page: [[name, value, explanation]].
export function figures(workers, work) {
  const able = workers.filter((worker) => !worker.closed && !worker.fault && !worker.not_claiming_since_s);
  const slots = sum(able, "slots");
  const held = work.tasks.filter((task) => task.status === "running").length;
  const disk = work.free_bytes === null ? "no limit known" : `${bytes(work.free_bytes)} free`;
  const files = work.free_files === null ? "" : `${count(work.free_files)} further files (inodes)`;
  return [
    ["Workers", count(workers.length), able.length < workers.length ? `${count(able.length)} take orders` : ""],
    ["Slots in use", `${count(held)} of ${count(slots)}`, ""],
    ["Waiting", many(sum(work.waiting, "jobs"), "job"), many(sum(work.waiting, "ready_tasks"), "task") + " ready"],
    ["Store", disk, files],
    ["Artifacts", work.artifact_bytes === null ? "not known" : bytes(work.artifact_bytes), "of all owners"],
  ];
}

const sum = (items, name) => items.reduce((total, item) => total + item[name], 0);
