"""The engine of a job, chosen in one place."""

from __future__ import annotations

from collections.abc import Mapping

from lippmann.job.rendering.engines import Engine as EngineName
from lippmann.job.resolved import ResolvedJob
from worker.engines.engine import Engine
from worker.engines.mitsuba.engine import MitsubaEngine
from worker.engines.povray.engine import PovrayEngine

ENGINES: Mapping[EngineName, Engine] = {"povray": PovrayEngine(), "mitsuba": MitsubaEngine()}
"""The engines by their names."""


def engine_of(job: ResolvedJob) -> Engine:
    """Return the engine that renders a job."""
    return ENGINES[job.engine]
