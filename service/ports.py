"""What is handed to the service: artifact store, pictures, scenes.

The service asks for these shapes and imports none of the things behind them; the `lippmann` package builds real ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.job.scene import SceneCard
from lippmann.job.viewing import Filter


class ArtifactInfo(Protocol):
    """One artifact in a list."""

    @property
    def name(self) -> str:
        """Its full name."""

    @property
    def size(self) -> int:
        """Bytes."""

    @property
    def modified_s(self) -> float:
        """Seconds since 1970, UTC."""

    @property
    def etag(self) -> str:
        """Changes when the content does; no quotes."""


class CheckedBundle(Protocol):
    """A scene bundle that is whole."""

    @property
    def card(self) -> SceneCard:
        """What its `scene.toml` says."""

    @property
    def digest(self) -> str:
        """SHA-256 of the zip."""

    @property
    def poster(self) -> bytes | None:
        """Its picture, PNG."""


class ArtifactStore(Protocol):
    """Where artifacts lie. Names are POSIX paths; there means whole."""

    def put_bytes(self, name: str, data: bytes) -> None:
        """Store data, whole or not at all."""

    def put_file(self, name: str, path: Path) -> None:
        """Store a file, whole or not at all."""

    def get_bytes(self, name: str) -> bytes:
        """Return an artifact; ArtifactMissing if it is not there."""

    def exists(self, name: str) -> bool:
        """Return whether an artifact is there."""

    def size(self, name: str) -> int:
        """Return an artifact's bytes; ArtifactMissing if it is not there."""

    def etag(self, name: str) -> str:
        """Return an artifact's entity tag, without quotes; ArtifactMissing if it is not there."""

    def read_range(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """Yield bytes [start, stop) of an artifact in chunks."""

    def list(self, prefix: str, *, after: str = "", limit: int | None = None) -> Sequence[ArtifactInfo]:
        """Return the artifacts below a prefix, by name: those after a name, and not more than `limit`."""

    def folders(self) -> Sequence[str]:
        """Return the first parts of all names that have several, sorted."""

    def delete(self, prefix: str) -> None:
        """Delete every artifact below a prefix."""

    def local_path(self, name: str) -> AbstractContextManager[Path]:
        """Lend an artifact as a readable file."""

    def free_bytes(self) -> int | None:
        """Return how much room is left; None for a store that has no end."""


class Pictures(Protocol):
    """Reads masters, and makes what people open."""

    def png(self, path: Path, *, bits: int = 8) -> bytes:
        """Return a linear EXR as an sRGB PNG of 8 or 16 bits."""

    def light(self, path: Path) -> NDArray[np.float16]:
        """Return a linear EXR, `(rows, cols, 3)`."""

    def shown(
        self,
        light: NDArray[np.floating[Any]],
        *,
        as_format: Literal["png", "webp"],
        scale: int = 1,
        filter_name: Filter = "lanczos3",
    ) -> bytes:
        """Return linear light `(rows, cols, 3)`, enlarged, as an sRGB file."""


class Scenes(Protocol):
    """Knows scene bundles."""

    def builtin(self) -> dict[str, bytes]:
        """Return the zips of the scenes that come with Lippmann, by name."""

    def check(self, data: bytes) -> CheckedBundle:
        """Return what a bundle holds; BundleError names the file and field that is wrong."""


@dataclass(frozen=True)
class Parts:
    """Everything that is handed in."""

    store: ArtifactStore
    pictures: Pictures
    scenes: Scenes
