"""Keeps the orthoscopic sheets in memory that users view."""

from __future__ import annotations

import threading
from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from service.ports import Parts
from service.viewing.frames import ViewableFrame

Sheet = NDArray[np.float16]


class SheetCache:
    """The decoded sheets that were viewed last, up to a total size; for any number of threads."""

    def __init__(self, parts: Parts, *, room_bytes: int) -> None:
        self._parts, self._room_bytes = parts, room_bytes
        self._kept: OrderedDict[tuple[str, str], Sheet] = OrderedDict()
        self._lock = threading.Lock()
        self._decoding = threading.Lock()

    def sheet(self, frame: ViewableFrame) -> Sheet:
        """Return the orthoscopic sheet of a frame: linear light `(row, col, channel)`; it must not be modified.

        Raises
        ------
        ArtifactMissing, ArtifactBroken
            If the sheet was deleted in the meantime, or cannot be read.
        """
        key = (frame.sheet_name, frame.etag)
        known = self._known(key)
        if known is not None:
            return known
        # One at a time, because a user who drags a slider requests the same sheet several times before it is decoded.
        with self._decoding:
            known = self._known(key)
            if known is not None:
                return known
            with self._parts.store.local_path(frame.sheet_name) as path:
                sheet = self._parts.pictures.light(path)
            self._keep(key, sheet)
        return sheet

    def _known(self, key: tuple[str, str]) -> Sheet | None:
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def _keep(self, key: tuple[str, str], sheet: Sheet) -> None:
        with self._lock:
            self._kept[key] = sheet
            while len(self._kept) > 1 and sum(each.nbytes for each in self._kept.values()) > self._room_bytes:
                self._kept.popitem(last=False)
