"""The adapters that connect the service to the worker's code: artifact store, pictures and scenes.

The service names what it needs in `service.ports` and imports nothing from `worker`; this module builds it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.viewing import Filter, PictureFormat
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.plan.artifact_store import ArtifactStore
from povtemplates.catalogue import scene_folders
from service.ports import CheckedBundle, Parts
from worker.exports.netpbm import encoded_pfm
from worker.images.convert import encoded_picture, png
from worker.images.read import read_channels, read_rgb
from worker.sandbox.bundle import check_bundle, pack_folder


def make_parts(store: ArtifactStore) -> Parts:
    """Return the adapters of a service with a store."""
    return Parts(store=store, pictures=_Pictures(), scenes=_Scenes())


class _Pictures:
    def png(self, path: Path, *, bits: int = 8) -> bytes:
        return png(path, bits=16 if bits == 16 else 8)

    def light(self, path: Path) -> NDArray[np.float16]:
        return read_rgb(path, np.float16)

    def scene_depth(self, path: Path) -> NDArray[np.float32]:
        return np.asarray(read_channels(path, CHANNELS[:1])[..., 0])

    def pfm(self, values: NDArray[np.float32]) -> bytes:
        return encoded_pfm(values)

    def encode(
        self,
        light: NDArray[np.floating[Any]],
        *,
        as_format: PictureFormat,
        scale: int = 1,
        filter_name: Filter = "lanczos3",
    ) -> bytes:
        return encoded_picture(light, as_format=as_format, scale=scale, filter_name=filter_name)


class _Scenes:
    def builtin(self) -> dict[str, bytes]:
        return dict(_builtin())

    def check(self, data: bytes) -> CheckedBundle:
        return check_bundle(data)


@cache
def _builtin() -> dict[str, bytes]:
    return {name: pack_folder(folder) for name, folder in scene_folders().items()}
