"""The workers that may do the tasks of a job: their pool, their tags, their memory for a task, and their engine."""

from __future__ import annotations

import json
from collections.abc import Collection
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from lippmann.job.fields.model import JobModel

LABEL = r"[a-z0-9][a-z0-9._-]{0,31}"
"""The pattern of a tag and of the name of a pool."""
MAX_TAGS = 10
"""The greatest number of tags of a job and of a worker."""

Tag = Annotated[str, Field(pattern=f"^{LABEL}$")]
"""The name of something that a worker has, such as `fast-disk`."""
Pool = Annotated[str, Field(pattern=f"^({LABEL})?$")]
"""The name of a part of the farm; empty for the workers that are in no pool."""

ENGINE_TITLES = {"povray": "POV-Ray", "mitsuba": "Mitsuba"}
"""The engines as a sentence names them."""


class WorkerRequirement(JobModel):
    """The requirement of a job for the workers that do its tasks."""

    pool: Pool = ""
    """The pool whose workers do the tasks; if empty, the workers that are in no pool do them."""
    tags: tuple[Tag, ...] = Field(default=(), max_length=MAX_TAGS)
    """The tags that a worker must have, all of them."""
    memory_mb: int | None = Field(default=None, ge=1, le=100_000_000)
    """The memory in MB that a worker must give one task, by its `LIPPMANN_MEMORY_MB`; null for any."""

    @property
    def text(self) -> str:
        """The requirement as a short text, the same for equal requirements; empty if nothing is required.

        >>> WorkerRequirement(tags=("b", "a", "a")).text
        '{"tags":["a","b"]}'
        >>> WorkerRequirement().text
        ''
        """
        kept = {name: value for name, value in self._given().items() if value}
        return json.dumps(kept, sort_keys=True, separators=(",", ":")) if kept else ""

    def _given(self) -> dict[str, Any]:
        return {"pool": self.pool, "tags": sorted(set(self.tags)), "memory_mb": self.memory_mb}

    @classmethod
    def of(cls, text: str) -> Self:
        """Return the requirement of a text that `text` gave.

        Raises
        ------
        ValidationError
            If it is another text.
        """
        return cls.model_validate_json(text) if text else cls()

    def lacks(self, *, pool: str, tags: Collection[str], memory_mb: int | None) -> tuple[str, ...]:
        """Return what a worker lacks, as parts of a sentence; empty if it may do the tasks.

        >>> need = WorkerRequirement(tags=("gpu",), memory_mb=64_000)
        >>> need.lacks(pool="", tags=["fast-disk"], memory_mb=16_000)
        ('the tag gpu', '64000 MB for a task')
        >>> need.lacks(pool="night", tags=["gpu"], memory_mb=64_000)
        ('no pool',)
        """
        lacking = []
        if pool != self.pool:
            lacking.append(f"the pool {self.pool}" if self.pool else "no pool")
        lacking += [f"the tag {tag}" for tag in sorted(set(self.tags) - set(tags))]
        if self.memory_mb is not None and (memory_mb or 0) < self.memory_mb:
            lacking.append(f"{self.memory_mb} MB for a task")
        return tuple(lacking)


class JobRequirement(WorkerRequirement):
    """The requirement of a resolved job: what it asks for, and the engine that its scene needs."""

    engine: Literal["none", "povray", "mitsuba"] = "povray"
    """The engine that a worker must have; `none` for a job that renders nothing."""

    def _given(self) -> dict[str, Any]:
        # A text without an engine is about POV-Ray, the only engine of earlier releases.
        return super()._given() | {"engine": "" if self.engine == "povray" else self.engine}

    def lacks_of(
        self, *, pool: str, tags: Collection[str], memory_mb: int | None, engines: Collection[str]
    ) -> tuple[str, ...]:
        """Return what a worker with some engines lacks, as parts of a sentence; empty if it may do the tasks.

        >>> JobRequirement(engine="mitsuba").text
        '{"engine":"mitsuba"}'
        >>> JobRequirement(engine="mitsuba").lacks_of(pool="", tags=[], memory_mb=None, engines=["povray"])
        ('the engine Mitsuba',)
        """
        lacking = self.lacks(pool=pool, tags=tags, memory_mb=memory_mb)
        is_there = self.engine == "none" or self.engine in engines
        return lacking if is_there else (*lacking, f"the engine {ENGINE_TITLES[self.engine]}")


@lru_cache(maxsize=4096)
def without_engine(requirement: str) -> str:
    """Return the requirement of those tasks of a job that render nothing; both are given as `JobRequirement.text`.

    Tasks of POV-Ray's jobs all need POV-Ray: they are in the queue that each worker with POV-Ray always polls.

    >>> without_engine('{"engine":"mitsuba","pool":"night"}')
    '{"engine":"none","pool":"night"}'
    >>> without_engine("")
    ''
    """
    needed = JobRequirement.of(requirement)
    return needed.model_copy(update={"engine": "none"}).text if needed.engine == "mitsuba" else requirement
