"""What a worker is told by its environment: LIPPMANN_..."""

from __future__ import annotations

import logging
import os
import platform
from pathlib import Path
from typing import Any, Literal

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from lippmann.job.old_names import rename_settings

STOPPING = "stopping-"
"""What the names of stopping files begin with."""


class WorkerSettings(BaseSettings):
    """Settings of one worker."""

    model_config = SettingsConfigDict(env_prefix="LIPPMANN_", frozen=True, extra="ignore")

    redis_url: str = "redis://127.0.0.1:6379/0"
    """Where orders come from and events go: redis:// or unix:// ."""
    data_dir: Path = Path("data")
    """Where artifacts lie (below artifacts/), shared with the service, and this worker's scratch folders."""
    slots: int = Field(default_factory=lambda: os.cpu_count() or 1, ge=1, le=1024)
    """How many tasks run at once: one POV-Ray thread each."""
    worker_name: str = Field(default_factory=lambda: f"{platform.node()}-{os.getpid()}", min_length=1, max_length=100)
    """What the worker is called; two with one name would be taken for one."""
    sandbox: Literal["auto", "bwrap", "landlock", "none"] = "auto"
    """What holds POV-Ray; `none` only for scenes of one's own."""
    povray: str = "povray"
    """POV-Ray's command."""
    heartbeat_file: Path | None = None
    """Touched every few seconds while the worker lives: for a container's health check."""

    def __init__(self, **values: Any) -> None:
        for note in rename_settings(os.environ):
            logging.getLogger(__name__).warning(note)
        super().__init__(**values)

    @property
    def artifacts_dir(self) -> Path:
        """Where the local artifact store lies."""
        return self.data_dir / "artifacts"

    @property
    def scratch_dir(self) -> Path:
        """Where attempts work and bundles are unpacked."""
        return self.data_dir / "scratch"

    @property
    def attempts_dir(self) -> Path:
        """Where each attempt has its folder."""
        return self.scratch_dir / "attempts"

    @property
    def bundles_dir(self) -> Path:
        """Where scene bundles are unpacked."""
        return self.scratch_dir / "bundles"

    @property
    def stopping_file(self) -> Path:
        """What is there while the worker is being shut down."""
        return self.scratch_dir / f"{STOPPING}{self.worker_name}"
