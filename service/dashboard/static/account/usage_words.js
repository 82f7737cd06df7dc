// What the limits of a key are called, and how much of them is used. Pure: no DOM, no Preact.
import { bytes, count, duration, quantity } from "../shared/format.js";

const megabytes = (number) => bytes(number * 1_000_000);
const pixels = (number) => `${count(number)} px`;

const OWNER = "What your jobs, scenes and files may take together";
const JOB = "What one job may take";

// By the name of a limit: its title, its group, how a number of it is written.
const LIMITS = {
  open_jobs: ["Open jobs", OWNER, count],
  open_frames: ["Frames of open jobs", OWNER, count],
  slots: ["Slots at the same time", OWNER, count],
  artifacts_mb: ["Stored artifacts", OWNER, megabytes],
  scenes: ["Scenes", OWNER, count],
  bundles: ["Scene bundles", OWNER, count],
  bundles_mb: ["Stored scene bundles", OWNER, megabytes],
  picture_s_per_minute: ["Seconds of pictures on demand, a minute", OWNER, quantity],
  frames: ["Frames", JOB, count],
  tasks: ["Tasks", JOB, count],
  frame_px: ["Pixels of a frame", JOB, pixels],
  job_px: ["Pixels of all frames", JOB, pixels],
  memory_mb: ["Memory of a task", JOB, megabytes],
  timeout_s: ["Time of a task", JOB, duration],
};

// The limits by group: [[title, rows]]; a row is {name, title, used, limit, share, source}. `used` and `share` are null
// for a limit that is not counted.
export function usageGroups(items) {
  const groups = new Map([OWNER, JOB].map((group) => [group, []]));
  for (const item of items) {
    const [title, group, write] = LIMITS[item.name] || [item.name.replaceAll("_", " "), JOB, quantity];
    groups.get(group).push({
      name: item.name,
      title,
      used: item.used === null ? null : write(item.used),
      limit: write(item.limit),
      share: item.used === null || !item.limit ? null : Math.min(1, item.used / item.limit),
      source: item.source.endsWith("of the key") ? "set by your key" : "set by the farm",
    });
  }
  return [...groups].filter(([, rows]) => rows.length);
}

// How full a limit is, as the class of its bar.
export function fullness(share) {
  if (share >= 1) return "failed";
  return share >= 0.8 ? "paused" : "";
}

const MAY = {
  viewer:
    "You see jobs, scenes and workers, download files and compute designs. Submitting needs a key of a submitter.",
  submitter: "You submit jobs, upload scenes, and change what belongs to your owner.",
  admin: "You change everybody's jobs, scenes and workers, make and revoke keys, and read the audit log.",
};

export const mayOf = (role) => MAY[role] || "";
