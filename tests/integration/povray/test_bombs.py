"""Pictures and fonts of a bundle that lie: POV-Ray opens them inside the sandbox, within its memory."""

from __future__ import annotations

import struct

import pytest

from lippmann.errors import OutOfMemory, RenderCrashed, SceneError
from tests.bombs import exr, jpeg, png, tiff
from tests.integration.povray.conftest import BALL, Room
from worker.sandbox.limits import Limits

MEMORY_MB = 512
MAP = 'plane {{ z, 1 pigment {{ image_map {{ {} "bomb" }} }} }}\n'
BOMBS: dict[str, tuple[str, bytes]] = {
    "png": (MAP.format("png"), png(32768, 32768)),
    "tiff": (MAP.format("tiff"), tiff({256: 65_000, 257: 65_000})),
    "exr": (MAP.format("exr"), exr((0, 0, 60_000, 60_000))),
    "jpeg": (MAP.format("jpeg"), jpeg(65500, 65500)),
    "gif": (MAP.format("gif"), b"GIF89a\xff\xff\xff\xff\xf7\0\0" + bytes(768) + b",\0\0\0\0\xff\xff\xff\xff\0\x08\0\0"),
    "tga": (MAP.format("tga"), struct.pack("<3B5x4H2B", 0, 0, 2, 0, 0, 65535, 65535, 24, 0) + bytes(100)),
    "ppm": (MAP.format("ppm"), b"P6\n65535 65535\n255\n" + bytes(100)),
    "font": ('text { ttf "bomb" "a" 1, 0 pigment { rgb 1 } }\n', b"\0\1\0\0\xff\xff" + b"\xff" * 2000),
}


@pytest.mark.parametrize("kind", BOMBS)
def test_a_file_that_lies_ends_its_own_task(held: Room, kind: str) -> None:
    scene, data = BOMBS[kind]
    (held.bundle / "bomb").write_bytes(data)
    with pytest.raises((SceneError, OutOfMemory, RenderCrashed)) as ended:
        held.render(scene, limits=Limits(cpu_s=60, memory_mb=MEMORY_MB))
    assert "tile.pov line 3: " in ended.value.message or f"limit {MEMORY_MB} MB" in ended.value.message


def test_a_picture_after_all_this_is_rendered(best: Room) -> None:
    assert best.render(BALL).picture.exists()
