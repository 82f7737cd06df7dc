"""Keeps the orthoscopic sheets in memory that users view."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from service.ports import Pictures
from service.viewing.viewable_frame import ViewableFrame

Sheet = NDArray[np.float16]
LocalPath = Callable[[], Path]
"""Returns the path of a file with the content of the artifact that a picture is made of."""


class SheetCache:
    """The decoded sheets that were viewed last, up to a total size."""

    def __init__(self, pictures: Pictures, *, room_bytes: int) -> None:
        self._pictures, self._room_bytes = pictures, room_bytes
        self._kept: OrderedDict[tuple[str, str], Sheet] = OrderedDict()

    def sheet(self, frame: ViewableFrame, local_path: LocalPath) -> Sheet:
        """Return the orthoscopic sheet of a frame: linear light `(row, col, channel)`; it must not be modified.

        Raises
        ------
        ArtifactBroken
            If the sheet cannot be read.
        """
        key = (frame.sheet_name, frame.etag)
        if key not in self._kept:
            self._kept[key] = self._pictures.light(local_path())
        self._kept.move_to_end(key)
        while len(self._kept) > 1 and sum(each.nbytes for each in self._kept.values()) > self._room_bytes:
            self._kept.popitem(last=False)
        return self._kept[key]
