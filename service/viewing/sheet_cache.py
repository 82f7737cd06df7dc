"""Keeps the orthoscopic sheets in memory that users view, and their true depths."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.ports import Pictures
from service.viewing.viewable_frame import ViewableFrame

Sheet = NDArray[np.float16]
LocalPath = Callable[[], Path]
"""Returns the path of a file with the content of the artifact that a picture is made of."""


class SheetCache:
    """The decoded sheets and depths that were viewed last, up to a total size."""

    def __init__(self, pictures: Pictures, *, room_bytes: int) -> None:
        self._pictures, self._room_bytes = pictures, room_bytes
        self._kept: OrderedDict[tuple[str, str], NDArray[Any]] = OrderedDict()

    def sheet(self, frame: ViewableFrame, local_path: LocalPath) -> Sheet:
        """Return the orthoscopic sheet of a frame: linear light `(row, col, channel)`; it must not be modified.

        Raises
        ------
        ArtifactBroken
            If the sheet cannot be read.
        """
        return self._read((frame.sheet_name, frame.etag), self._pictures.light, local_path)

    def scene_depth(self, name: str, etag: str, local_path: LocalPath) -> NDArray[np.float32]:
        """Return the distances in the scene of a depth master, `(row, col)`, mm; they must not be modified.

        Raises
        ------
        ArtifactBroken
            If the master cannot be read.
        """
        return self._read((name, etag), self._pictures.scene_depth, local_path)

    def _read(self, key: tuple[str, str], read: Callable[[Path], NDArray[Any]], local_path: LocalPath) -> NDArray[Any]:
        if key not in self._kept:
            self._kept[key] = read(local_path())
        self._kept.move_to_end(key)
        while len(self._kept) > 1 and sum(each.nbytes for each in self._kept.values()) > self._room_bytes:
            self._kept.popitem(last=False)
        return self._kept[key]
