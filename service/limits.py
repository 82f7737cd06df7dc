"""The limits of a caller: those of the farm, or lower ones of the key."""

from __future__ import annotations

from dataclasses import dataclass

from service.schemas.access import KeyLimits
from service.settings import Settings

MEGABYTE = 1_000_000


@dataclass(frozen=True)
class Limit:
    """The largest value of something, and who sets it."""

    value: float
    source: str

    def __str__(self) -> str:
        return f"at most {self.value:.15g} ({self.source})"


class Limits:
    """The limits of a caller: of the farm, or lower ones of the key."""

    def __init__(self, settings: Settings, key: KeyLimits) -> None:
        self._settings = settings
        self._key = key

    def __getitem__(self, name: str) -> Limit:
        of_farm, of_key = getattr(self._settings, f"max_{name}"), getattr(self._key, name)
        if of_key is not None and of_key < of_farm:
            return Limit(of_key, f"the limit {name} of the key")
        return Limit(of_farm, f"LIPPMANN_MAX_{name.upper()} of the farm")
