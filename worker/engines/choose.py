"""The engine of a job, chosen in one place."""

from __future__ import annotations

from collections.abc import Mapping

from lippmann.errors import WorkerOutdated
from lippmann.job.engines import Engine as EngineName
from lippmann.job.resolved import ResolvedJob
from worker.engines.engine import Engine
from worker.engines.povray.engine import PovrayEngine

ENGINES: Mapping[EngineName, Engine] = {"povray": PovrayEngine()}
"""The engines by their names."""


def engine_of(job: ResolvedJob) -> Engine:
    """Return the engine that renders a job.

    Raises
    ------
    WorkerOutdated
        If this release has no such engine.
    """
    engine = ENGINES.get(job.engine)
    if engine is None:
        raise WorkerOutdated(f"this worker has the engines {', '.join(ENGINES)}, and the job needs {job.engine}")
    return engine
