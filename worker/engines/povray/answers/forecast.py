"""The forecast of the moment at which POV-Ray needs its core no longer."""

from __future__ import annotations

import time
from collections.abc import Callable

from worker.engines.povray.answers.progress import Phase, Progress

LEAD_S = 0.6
"""The time from an order to the moment at which POV-Ray parses, which is 0.4 s: claim, sandbox, and 0.27 s in which
POV-Ray waits for its own threads; and 0.2 s to the next report of its progress (measured)."""
LEAST_S = 0.1
"""The least time of tracing from which a forecast is made, since POV-Ray reports in bursts."""


class EndForecast:
    """Forecasts from the progress whether the tracing ends within `LEAD_S`."""

    def __init__(self, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begun: tuple[float, float] | None = None
        """The time at which the tracing began, or of its first report, and the fraction that was done then."""

    def ends_soon(self, progress: Progress) -> bool:
        """Return whether the tracing has ended or is expected to end soon, after a new report of progress."""
        now_s = self._clock()
        if progress.phase is not Phase.RENDERING:
            # A pretrace and photons come between the end of the preparation and the tracing.
            self._begun = (now_s, progress.fraction) if progress.phase is Phase.PREPARING else None
            return False
        if self._begun is None:
            self._begun = now_s, progress.fraction
        begun_s, first = self._begun
        spent_s, grown = now_s - begun_s, progress.fraction - first
        if progress.fraction >= 1.0:
            return True
        return spent_s >= LEAST_S and spent_s * (1.0 - progress.fraction) <= LEAD_S * grown
