"""The settings of a worker, from environment variables LIPPMANN_..."""

from __future__ import annotations

import os
import platform
import secrets
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PrivateAttr, TypeAdapter, field_validator
from pydantic_settings import NoDecode, SettingsConfigDict

from lippmann.broker_settings import BrokerSettings
from lippmann.errors import BadInput
from lippmann.job.messages.seals import Seals
from lippmann.job.messages.worker_keys import KEY_ID, WorkerKey
from lippmann.job.optics.rig import MAX_FRAME_PX
from lippmann.job.rendering.workers import LABEL, MAX_TAGS, Tag
from lippmann.key_file import read_secret
from lippmann.plan.artifact_store import RESERVE_MB
from worker.hours import Hours, parse_hours

_WorkerTags = TypeAdapter(Annotated[tuple[Tag, ...], Field(max_length=MAX_TAGS)])

STOPPING = "stopping-"
"""The prefix of the names of stopping files."""


class WorkerSettings(BrokerSettings):
    """Settings of one worker."""

    model_config = SettingsConfigDict(extra="ignore")

    slots: int = Field(default_factory=lambda: os.cpu_count() or 1, ge=1, le=1024)
    """The number of tasks that run at the same time, each with one POV-Ray thread, or more if slots would idle."""
    worker_name: str = Field(default_factory=lambda: f"{platform.node()}-{os.getpid()}", min_length=1, max_length=100)
    """The name of the worker; it must be unique on the farm."""
    worker_pool: str = Field(default="", pattern=f"^({LABEL})?$")
    """The pool of the worker, whose jobs alone it does; if empty, it does the jobs that ask for no pool."""
    worker_tags: Annotated[tuple[str, ...], NoDecode] = Field(default_factory=tuple)
    """The tags of the worker, separated by commas, such as `fast-disk,big`; jobs may ask for workers that have some."""
    worker_hours: Annotated[Hours | None, NoDecode] = None
    """The hours in which it takes orders, such as `Mon-Fri 19:00-07:00, Sat-Sun 00:00-24:00`, by the clock of its
    machine; if empty, it always does."""
    drain_s: float = Field(default=0.0, ge=0)
    """The time that running attempts have to finish after SIGTERM, s, in which no order is taken; with 0 they end at
    once and are done again elsewhere."""
    sandbox: Literal["auto", "bwrap", "landlock", "none"] = "auto"
    """The sandbox of POV-Ray. A worker with `none` renders only the built-in scenes."""
    cgroup: str = "auto"
    """The cgroup below which each task has a group with its limits of memory and processes: `auto` for the one that
    systemd has delegated to the worker, `none`, or a folder, such as `/sys/fs/cgroup/lippmann`."""
    povray: str = "povray"
    """The command of POV-Ray."""
    needs_povray: bool = True
    """False if the worker starts without POV-Ray; scenes then wait until it is installed."""
    mitsuba: Literal["auto", "off", "llvm_ad_rgb", "cuda_ad_rgb"] = "auto"
    """`off` if the worker does not render with Mitsuba; `auto` if it does where Mitsuba works, on a GPU if there is
    one; or the only variant that it tries: `llvm_ad_rgb` for the processor, `cuda_ad_rgb` for a GPU of NVIDIA."""
    memory_mb: int = Field(default_factory=lambda: max(8192, _machine_memory_mb()), ge=128)
    """The address space that one process of an engine may use, MB; a job may only ask for less."""
    timeout_s: float = Field(default=7 * 86_400.0, gt=0)
    """The longest time of an attempt, s; a job may only ask for less."""
    parse_timeout_s: float | None = Field(default=None, gt=0)
    """The longest time for which a scene is parsed, s; a job may only ask for less."""
    photons_timeout_s: float | None = Field(default=None, gt=0)
    """The longest time for which photons are shot, s; a job may only ask for less."""
    probe_timeout_s: float | None = Field(default=None, gt=0)
    """The longest time of a probe, s; a job may only ask for less."""
    previews: bool = True
    """True if the worker renders previews, one at a time beside its slots."""
    preview_limit_s: float = Field(default=20.0, gt=0)
    """The longest time for which a preview is rendered, s; the service may have a lower limit."""
    disk_reserve_mb: float = Field(default=RESERVE_MB, ge=0)
    """The free space that artifacts and attempts leave on a disk, in megabytes."""
    bundles_mb: float = Field(default=20_000.0, ge=0)
    """The size of the unpacked scene bundles above which the least recently used ones are removed, in megabytes; those
    that an attempt uses stay."""
    picture_px: int = Field(default=2**27, ge=1, le=MAX_FRAME_PX**2)
    """The largest picture of another program that is decoded, in pixels; `lippmann import` and its like obey it too."""
    heartbeat_file: Path | None = None
    """A file that is touched every few seconds while the worker takes orders, or while the broker is unreachable, for
    the health check of a container."""
    final_event_s: float = Field(default=600.0, ge=0)
    """The time for which an attempt that has ended keeps its final event while the broker is unreachable."""
    worker_key_file: Path | None = None
    """The file of the id and the secret of the worker's own key, as `lippmann worker --join` writes it; if empty, the
    worker signs its messages with the key of the farm only."""
    handover: bool = True
    """True if the next attempt of a slot starts while the one before it ends. Two scenes may then be in memory for a
    moment, so a worker with little memory may switch it off."""

    @field_validator("worker_tags", mode="before")
    @classmethod
    def _split_tags(cls, tags: object) -> object:
        if isinstance(tags, str):
            tags = tuple(tag.strip() for tag in tags.split(",") if tag.strip())
        return _WorkerTags.validate_python(tags)

    @field_validator("worker_hours", mode="before")
    @classmethod
    def _parse_hours(cls, text: object) -> object:
        try:
            return (parse_hours(text) if text.strip() else None) if isinstance(text, str) else text
        except BadInput as error:
            raise ValueError(error.message) from error

    _instance: str = PrivateAttr(default_factory=lambda: secrets.token_hex(8))

    @cached_property
    def worker_key(self) -> WorkerKey | None:
        """The worker's own key; None if it has none.

        Raises
        ------
        BadInput
            If its file cannot be read, or holds something else.
        """
        if self.worker_key_file is None:
            return None
        key_id, _, secret = read_secret(self.worker_key_file).partition(" ")
        if not KEY_ID.fullmatch(key_id) or not secret:
            raise BadInput(
                f"expected the id and the secret of a worker key in {self.worker_key_file}, got another text"
            )
        return WorkerKey.of_secret(key_id, secret)

    @property
    def seals(self) -> Seals:
        """The seals of the messages between the service and this worker."""
        return replace(super().seals, worker_key=self.worker_key)

    @property
    def instance(self) -> str:
        """A random name of this start of the worker process; its pool processes inherit it. It names the key too."""
        return self._instance if self.worker_key is None else self.worker_key.instance(self._instance)

    @property
    def processes(self) -> int:
        """The number of pool processes: one of each slot, and with handover one more, for the next attempt."""
        return 2 * self.slots if self.handover else self.slots

    @property
    def disk_reserve_bytes(self) -> int:
        """The free space that artifacts and attempts leave on a disk, in bytes."""
        return round(self.disk_reserve_mb * 1e6)

    @property
    def bundles_bytes(self) -> int:
        """The size of the unpacked scene bundles above which some are removed, in bytes."""
        return round(self.bundles_mb * 1e6)

    @property
    def artifacts_dir(self) -> Path:
        """The folder of the local artifact store."""
        return self.data_dir / "artifacts"

    @property
    def scratch_dir(self) -> Path:
        """The folder in which attempts work and bundles are unpacked."""
        return self.data_dir / "scratch"

    @property
    def attempts_dir(self) -> Path:
        """The folder with a folder for each attempt."""
        return self.scratch_dir / "attempts"

    @property
    def bundles_dir(self) -> Path:
        """The folder in which scene bundles are unpacked."""
        return self.scratch_dir / "bundles"

    @property
    def stopping_file(self) -> Path:
        """A file that exists while the worker is shutting down."""
        return self.scratch_dir / f"{STOPPING}{self.worker_name}"


def _machine_memory_mb() -> int:
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
