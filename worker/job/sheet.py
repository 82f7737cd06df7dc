"""The job as it is stored: what was asked for plus what it resolved to, so that every attempt sees the same.

`job.json` and `plan.json` are artifacts. The service writes them, workers read them.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from worker.job.scene import Stage
from worker.job.spec import Clock, JobSpec, ParameterValue


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class JobSheet(_Part):
    """`job.json`: a job with its scene resolved."""

    job_id: str
    spec: JobSpec
    bundle: str
    """SHA-256 of the scene bundle's zip; the artifact is `scenes/<bundle>.zip`."""
    stage: Stage
    clock: Clock
    parameters: dict[str, ParameterValue]
    """Every parameter of the scene, defaults filled in."""


class PlanSheet(_Part):
    """`plan.json`: how the job was cut."""

    tile_rows: int
    tile_cols: int
    probe_start_s: float
    probe_s_per_px: float
