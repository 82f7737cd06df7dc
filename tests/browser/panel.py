"""A stand-in for the bridge of a Looking Glass panel: it reads the messages and keeps the pictures.

It speaks what Looking Glass Bridge and HoloPlay Service speak at `ws://localhost:11222/driver`: CBOR (RFC 8949) after
the four bytes of a request of nanomsg's REQ protocol.
"""

from __future__ import annotations

import struct
import threading
from dataclasses import dataclass
from typing import Any

from websockets.sync.server import ServerConnection, serve
from websockets.typing import Subprotocol

REQUEST = Subprotocol("rep.sp.nanomsg.org")
PANEL_IS_AWAY = 4
_DEVICE = {"hwid": "LKG-PORT-00000", "hardwareVersion": "portrait"}


@dataclass(frozen=True)
class Shown:
    """A picture that the panel was asked to show."""

    settings: dict[str, Any]
    png: bytes


class PanelBridge:
    """A bridge on a free port of this machine."""

    def __init__(self) -> None:
        self.commands: list[str] = []
        """The names of the commands so far."""
        self.shown: list[Shown] = []
        self.error = 0
        """The error with which `show` is answered."""
        self._server = serve(self._serve, "127.0.0.1", 0, subprotocols=[REQUEST], max_size=2**26)
        self.url = f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}/driver"
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    def stop(self) -> None:
        self._server.shutdown()
        self._thread.join()

    def _serve(self, connection: ServerConnection) -> None:
        for message in connection:
            assert isinstance(message, bytes)
            assert message[0] & 0x80, "the highest bit of the number of a request is set"
            asked, end = _read(message, 4)
            assert end == len(message)
            answer = self._answer(asked["cmd"], asked["bin"])
            connection.send(message[:4] + _written(answer))

    def _answer(self, command: dict[str, Any], picture: bytes | None) -> dict[str, Any]:
        (name,) = command
        self.commands.append(name)
        if name == "info":
            return {"error": 0, "version": "2.4.7", "devices": [_DEVICE]}
        if name == "show" and not self.error:
            assert picture is not None
            assert command["show"]["source"] == "bindata"
            self.shown.append(Shown(command["show"]["quilt"]["settings"], picture))
        return {"error": self.error if name == "show" else 0}


def _read(data: bytes, at: int) -> tuple[Any, int]:
    """Return the value at a place of some CBOR, and the place after it."""
    kind, short = data[at] >> 5, data[at] & 31
    if kind == 7:
        if short == 27:
            return struct.unpack_from(">d", data, at + 1)[0], at + 9
        return {20: False, 21: True, 22: None}[short], at + 1
    width = {24: 1, 25: 2, 26: 4, 27: 8}.get(short, 0)
    size = int.from_bytes(data[at + 1 : at + 1 + width], "big") if width else short
    at += 1 + width
    if kind in (0, 1):
        return (size if kind == 0 else -1 - size), at
    if kind in (2, 3):
        part = data[at : at + size]
        return (part if kind == 2 else part.decode()), at + size
    found = []
    for _ in range(size * (kind - 3)):
        value, at = _read(data, at)
        found.append(value)
    return (found if kind == 4 else dict(zip(found[::2], found[1::2], strict=True))), at


def _written(value: Any) -> bytes:
    """Return short texts, numbers, lists and maps as CBOR."""
    if isinstance(value, str):
        return bytes([0x60 | len(value)]) + value.encode()
    if isinstance(value, int):
        return bytes([value])
    if isinstance(value, list):
        return bytes([0x80 | len(value)]) + b"".join(map(_written, value))
    return bytes([0xA0 | len(value)]) + b"".join(_written(one) for pair in value.items() for one in pair)
