"""The description of a kind of faults, and the job of its trials."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

from lippmann.job.outputs.videos import CentreVideo
from lippmann.job.spec import JobSpec
from tests.builders import small_job
from tests.chaos.parts import Parts

Injection = Callable[[Parts, str, Random], float | None]
"""Injects a fault into a farm whose job has this id; may return the seconds until nothing was with a lost worker."""


@dataclass(frozen=True)
class Work:
    """A job of a trial: so many frames, each of so many lenses in a row and in a column, and of so many tiles."""

    frames: int
    lenses: int
    tiles: int
    compared: int = 1
    """The step of the frames whose pixels are compared with those of an undisturbed farm."""
    scene: str = "fish"
    samples: int = 1
    """The number of rays a pixel."""
    stall_s: float | None = None
    """The time without progress after which a render is ended; None for the default."""

    def spec(self, frames: str) -> JobSpec:
        """Return the job with some of its frames, and with a video."""
        render = {"samples": self.samples} | ({} if self.stall_s is None else {"stall_s": self.stall_s})
        count = (self.lenses, self.lenses)
        spec = small_job(self.scene, count=count, frames=frames, tiles=[self.tiles, 1], render=render)
        return spec.model_copy(update={"outputs": (CentreVideo(),)})


SHORT = Work(frames=12, lenses=40, tiles=2)
LONG = Work(frames=1000, lenses=10, tiles=1, compared=37)


@dataclass(frozen=True)
class Kind:
    """One kind of fault."""

    name: str
    inject: Injection
    keeps_data: bool = False
    """Whether the broker has its data again after a restart."""
    damages: bool = False
    """Whether it damages an artifact that no task reads again, so that a user has the job repaired."""
    work: Work = SHORT
    hosts: bool = False
    """Whether each worker is in a network namespace of its own, as on a host of its own."""
    seven: bool = False
    """Whether each part is, which are seven with the database and the bucket."""
    recovers_within_s: float | None = None
    """The longest time until nothing is with a lost worker."""


class Kinds(dict[str, Kind]):
    """Kinds by name, in the order of the table."""

    def add(self, name: str, inject: Injection, **more: Any) -> None:
        """Add a kind; `more` are its other fields."""
        assert name not in self, name
        self[name] = Kind(name, inject, **more)

    def of(self, name: str, **more: Any) -> Callable[[Injection], Injection]:
        """Return a decorator that adds a function as a kind."""

        def add(inject: Injection) -> Injection:
            self.add(name, inject, **more)
            return inject

        return add


def pause(rng: Random, low_s: float, high_s: float) -> None:
    """Sleep for a random time: the length of a fault is what is tried."""
    time.sleep(rng.uniform(low_s, high_s))
