// The time of the service: the clock of this computer may be wrong, by an hour or by a day.

const RIGHT_MS = 5000; // A header tells whole seconds, and the answer was on its way.

let ahead_ms = 0; // of the service against this computer

// `date` is the Date header of an answer that comes from the service and from no cache.
export function hearDate(date, now_ms = Date.now()) {
  const away_ms = Date.parse(date) - now_ms;
  if (!Number.isNaN(away_ms)) ahead_ms = Math.abs(away_ms) < RIGHT_MS ? 0 : away_ms;
}

export const nowMs = () => Date.now() + ahead_ms;
