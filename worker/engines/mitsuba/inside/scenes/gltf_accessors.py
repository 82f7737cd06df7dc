"""The arrays of a glTF file: accessors, buffer views and buffers, checked against each other before they are read."""

from __future__ import annotations

import base64
import binascii
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from lippmann.untrusted.gltf_file import Accessor, GltfFile, Sparse
from worker.engines.mitsuba.inside.scenes.loaded import SceneFiles

_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_DIVISORS = {"<i1": 127.0, "<u1": 255.0, "<i2": 32767.0, "<u2": 65535.0}
"""The integer of 1.0 in a normalized accessor (glTF 2.0 specification, section 3.11)."""


MAX_ZEROS = 20_000_000
"""The greatest number of elements of an accessor that has no buffer view: all but some are 0."""


class GltfArrays:
    """The arrays of one glTF file."""

    def __init__(self, file: GltfFile, files: SceneFiles) -> None:
        self.document = file.document
        self.files = files
        self._binary = file.binary
        self._buffers: dict[int, bytes] = {}

    def item(self, kind: str, index: int, place: str) -> Any:
        """Return an item of a list of the document, such as number 3 of `materials`."""
        items = getattr(self.document, kind)
        if index >= len(items):
            raise self.files.refuse(place, f"one of the {len(items)} {kind}", index)
        return items[index]

    def accessor(self, index: int, place: str, *, types: tuple[str, ...]) -> NDArray[Any]:
        """Return the numbers of an accessor, shape (count, width); normalized integers as floats of 0 to 1.

        Raises
        ------
        SceneError
            If the accessor has another type, does not fit its buffer, or has a number that is not finite.
        """
        found: Accessor = self.item("accessors", index, place)
        where = f"{self.files.name}: accessors.{index}"
        if found.type not in types:
            raise self.files.refuse(f"{where}.type", f"{' or '.join(types)} for {place}", found.type)
        if found.bufferView is None and (found.sparse is None or found.count > MAX_ZEROS):
            expected = f"an accessor with a buffer view, or a sparse one of at most {MAX_ZEROS:,}"
            raise self.files.refuse(where, expected, f"{found.count:,} without")
        if found.type.startswith("MAT") and (found.type != "MAT4" or found.componentType != 5126):
            raise self.files.refuse(where, "matrices MAT4 of floats", f"{found.type} of {found.componentType}")
        dtype, width = np.dtype(_DTYPES[found.componentType]), _WIDTHS[found.type]
        raw: NDArray[Any] = np.zeros((0 if found.bufferView is not None else found.count, width), dtype)
        if found.bufferView is not None:
            raw = self._elements(found.bufferView, found.byteOffset, (found.count, width), dtype, where)
        if found.sparse is not None:
            raw = self._changed(raw, found.sparse, f"{where}.sparse")
        if found.componentType == 5126:
            if not np.isfinite(raw).all():
                raise self.files.refuse(where, "finite numbers", "NaN or infinity")
            return raw.astype(np.float64)
        if found.normalized and dtype.str.replace("|", "<") in _DIVISORS:
            return np.maximum(raw / _DIVISORS[dtype.str.replace("|", "<")], -1.0)
        return raw.astype(np.int64)

    def _elements(
        self, view: int, offset: int, shape: tuple[int, int], dtype: np.dtype[Any], where: str
    ) -> NDArray[Any]:
        """Return elements of a buffer view, which are not copied."""
        data, stride = self._view(view, f"{where}.bufferView")
        size = dtype.itemsize * shape[1]
        stride = stride or size
        needed = offset + (shape[0] - 1) * stride + size
        if needed > len(data) or stride < size:
            raise self.files.refuse(
                f"{where}.count", f"at most the {len(data):,} bytes of its buffer view", f"{needed:,}"
            )
        return np.ndarray(shape, dtype, buffer=data, offset=offset, strides=(stride, dtype.itemsize))

    def _changed(self, base: NDArray[Any], sparse: Sparse, where: str) -> NDArray[Any]:
        """Return elements with those of a sparse accessor in their places."""
        found, at = sparse.indices, np.dtype(_DTYPES[sparse.indices.componentType])
        places = self._elements(found.bufferView, found.byteOffset, (sparse.count, 1), at, f"{where}.indices")[:, 0]
        if (np.diff(places.astype(np.int64)) <= 0).any() or places[-1] >= len(base):
            raise self.files.refuse(f"{where}.indices", f"places that rise, below {len(base):,}", "others")
        shape = sparse.count, base.shape[1]
        changed = base.copy()
        held = sparse.values
        changed[places] = self._elements(held.bufferView, held.byteOffset, shape, base.dtype, f"{where}.values")
        return changed

    def bytes_of_view(self, index: int, place: str) -> bytes:
        """Return the bytes of a buffer view, such as those of a picture."""
        return bytes(self._view(index, place)[0])

    def file_or_data(self, uri: str, place: str, *, at_most: int | None = None) -> bytes:
        """Return the bytes of a data URI, or of a file of the bundle."""
        if uri.startswith("data:"):
            head, _, text = uri.partition(",")
            try:
                return base64.b64decode(text, validate=True) if head.endswith(";base64") else unquote(text).encode()
            except binascii.Error as error:
                raise self.files.refuse(place, "base64 in a data URI", error) from error
        path = self.files.path(unquote(uri), beside=self.files.name, place=place)
        with path.open("rb") as file:
            return file.read(-1 if at_most is None else at_most)

    def _view(self, index: int, place: str) -> tuple[memoryview, int | None]:
        view = self.item("bufferViews", index, place)
        data = self._buffer(view.buffer, f"{self.files.name}: bufferViews.{index}.buffer")
        if view.byteOffset + view.byteLength > len(data):
            end = view.byteOffset + view.byteLength
            where = f"{self.files.name}: bufferViews.{index}.byteLength"
            raise self.files.refuse(where, f"a range of the {len(data):,} bytes of its buffer", f"an end at {end:,}")
        return memoryview(data)[view.byteOffset : view.byteOffset + view.byteLength], view.byteStride

    def _buffer(self, index: int, place: str) -> bytes:
        if index not in self._buffers:
            buffer = self.item("buffers", index, place)
            where = f"{self.files.name}: buffers.{index}"
            if buffer.uri is not None:
                data = self.file_or_data(buffer.uri, f"{where}.uri")
            elif index == 0 and self._binary is not None:
                data = self._binary
            else:
                raise self.files.refuse(f"{where}.uri", "a file or data, or the binary chunk of a .glb", "none")
            if len(data) < buffer.byteLength:
                raise self.files.refuse(
                    f"{where}.byteLength", f"at most the {len(data):,} bytes there", buffer.byteLength
                )
            self._buffers[index] = data[: buffer.byteLength]
        return self._buffers[index]
