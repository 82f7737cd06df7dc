"""Ports: the interfaces that the service needs and does not implement: pictures and scene bundles.

The service imports none of the implementations; `lippmann.farm.adapters` provides them. The interface of the artifact
store, which workers share, is `lippmann.plan.artifact_store`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.viewing import Filter, PictureFormat
from lippmann.job.scenes.scene import SceneManifest
from lippmann.plan.artifact_store import ArtifactStore


class CheckedBundle(Protocol):
    """A scene bundle that was found valid."""

    @property
    def card(self) -> SceneManifest:
        """The content of its `scene.toml`."""

    @property
    def digest(self) -> str:
        """The SHA-256 of the zip file."""

    @property
    def poster(self) -> bytes | None:
        """The poster of the scene, a PNG."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on files of the zip that are not in the bundle."""


class Pictures(Protocol):
    """Reads masters and encodes pictures for browsers."""

    def png(self, path: Path, *, bits: int = 8) -> bytes:
        """Convert a linear EXR to an sRGB PNG of 8 or 16 bits."""

    def light(self, path: Path) -> NDArray[np.float16]:
        """Read a linear EXR as an array `(row, col, channel)`."""

    def scene_depth(self, path: Path) -> NDArray[np.float32]:
        """Read the distances in the scene from a depth master, `(row, col)`, mm; see `DepthMap.z_mm`."""

    def pfm(self, values: NDArray[np.float32]) -> bytes:
        """Encode numbers `(row, col)` as PFM."""

    def encode(
        self,
        light: NDArray[np.floating[Any]],
        *,
        as_format: PictureFormat,
        scale: int = 1,
        filter_name: Filter = "lanczos3",
    ) -> bytes:
        """Enlarge linear light `(row, col, channel)`; encode it as an sRGB file, or linearly as EXR."""


class Scenes(Protocol):
    """Provides and checks scene bundles."""

    def builtin(self) -> dict[str, bytes]:
        """Return the zip files of the built-in scenes, by name."""

    def check(self, data: bytes) -> CheckedBundle:
        """Check a bundle and return its content; BundleError names the file and field at fault."""


@dataclass(frozen=True)
class Parts:
    """The implementations that the service is given."""

    store: ArtifactStore
    pictures: Pictures
    scenes: Scenes
