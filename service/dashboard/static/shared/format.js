// Formats of numbers, durations and times.

const whole = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });
const short = new Intl.NumberFormat("en", { maximumSignificantDigits: 4 });
const moment = new Intl.DateTimeFormat(undefined, { dateStyle: "medium", timeStyle: "medium" });

export const count = (number) => whole.format(number);
export const quantity = (number) => short.format(number);
export const percent = (share) => `${Math.floor(share * 100)}\u202f%`;
export const by = (rows, cols) => `${count(rows)} × ${count(cols)}`;
export const many = (number, one, more = `${one}s`) => `${count(number)} ${number === 1 ? one : more}`;

export function duration(seconds) {
  const total = Math.max(0, Math.round(seconds));
  if (total < 60) return `${total} s`;
  const minutes = Math.floor(total / 60);
  if (minutes < 60) return total < 600 ? `${minutes} min ${total % 60} s` : `${minutes} min`;
  const hours = Math.floor(minutes / 60);
  return hours < 48 ? `${hours} h ${minutes % 60} min` : `${Math.floor(hours / 24)} d ${hours % 24} h`;
}

export const secondsBetween = (start, end) => (Date.parse(end) - Date.parse(start)) / 1000;

export function ago(time, now_ms) {
  const seconds = (now_ms - Date.parse(time)) / 1000;
  if (seconds < 45) return "just now";
  if (seconds < 3600) return `${Math.max(1, Math.round(seconds / 60))} min ago`;
  if (seconds < 86_400) return `${Math.round(seconds / 3600)} h ago`;
  return `${Math.round(seconds / 86_400)} d ago`;
}

export const exactTime = (time) => moment.format(new Date(time));

export function bytes(number) {
  const units = ["B", "kB", "MB", "GB", "TB"];
  const step = number < 1 ? 0 : Math.min(units.length - 1, Math.floor(Math.log10(number) / 3));
  return `${short.format(Number((number / 1000 ** step).toPrecision(3)))} ${units[step]}`;
}

export const jobName = (job) => job.title.trim() || job.scene;
