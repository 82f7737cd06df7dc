"""The readers of foreign files that are fuzzed: pictures, names of files, names in scenes, and what POV-Ray prints."""

from __future__ import annotations

import os
import struct
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from random import Random
from typing import Any

from PIL import Image

from tests import bombs
from tests.security.mutations import mutated_bytes
from worker.engines.povray.answers.hints import with_hint
from worker.engines.povray.answers.messages import MessageKind, read_messages
from worker.engines.povray.answers.places import ScenePlaces
from worker.engines.povray.scenes.scene_files import SceneFiles
from worker.images.foreign.header import read_header
from worker.sandbox.bundle import check_bundle, pack_folder
from worker.untrusted import read_imported

Read = Callable[[bytes], object]
Make = Callable[[Random], bytes]

_NUMBERS = (0, 1, 2, 3, 8, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1, 2**43, 2**62, 2**63 - 1, 2**64 - 1)
SCENES = (
    b'#version 3.7;\n#include "colors.inc"\n#include "Maps/WOOD.inc"\npigment { image_map { png "a.PNG" } }',
    b'\xef\xbb\xbf#declare F = "maps\\\\wood.inc"; // 6" long\ntext { ttf "TIMROM.TTF" "Hi" 1, 0 }\n#include "s"',
)
OUTPUTS = (
    b"File 's.pov' line 2: Possible Parse Error: Cannot find file\n 'Maps\\A.png', even after trying to append"
    b" file type\n extension.\nFile 's.pov' line 2: Parse Error: Cannot open include file\n",
    b"File 'lippmann-frame.pov' line 3: Parse Error: No matching }\n in 'union', global_settings found instead\n",
    b"File 'lippmann-names/A.png' line 99999: Parse Warning: This rendering uses the following\n",
)
FRAME = '#include "lippmann/stage.inc"\n#include "s.pov"\nglobal_settings { max_trace_level 24 }\n'
MANIFEST = b'file = "s.pov"\n[stage]\nlocation = [0, 0, -1000]\nlook_at = [0, 0, 0]\nnear_mm = 1000\nfar_mm = 2000\n'
NAMES = (b"wood.png", b"Wood \xc3\xa9.inc", b"._a", b"NUL", b"a\\b", b"lippmann-a.inc", b"\xff\xfe", b"desktop.ini")


@cache
def pictures() -> Mapping[str, tuple[bytes, ...]]:
    """Return small pictures by their format: whole ones, and ones without pixels."""
    small = Image.linear_gradient("L").resize((6, 5)).convert("RGB")
    exif = Image.Exif()
    exif[0x0112] = 6  # the orientation

    def saved(kind: str, **options: Any) -> bytes:
        file = BytesIO()
        small.save(file, kind, **options)
        return file.getvalue()

    pages = saved("TIFF", save_all=True, append_images=[small, small])
    tiled = bombs.tiff({322: 16, 323: 16, 324: 8, 325: 16})
    return {
        "png": (saved("PNG"), saved("PNG", icc_profile=bytes(200)), bombs.png(6, 5)),
        "tiff": (saved("TIFF"), saved("TIFF", compression="tiff_lzw"), saved("TIFF", big_tiff=True), pages, tiled),
        "jpeg": (saved("JPEG"), saved("JPEG", exif=exif, icc_profile=bytes(200)), bombs.jpeg(6, 5)),
        "exr": (bombs.exr(), bombs.exr(tile=(8, 8))),
        "pnm": (
            b"P6\n3 2\n255\n" + bytes(18),
            b"P5 # a comment\n3 2\n65535\n" + bytes(12),
            b"PF\n3 2\n-1.0\n" + bytes(72),
        ),
    }


def _picture_bytes(kind: str, random: Random) -> bytes:
    seeds = pictures()[kind]
    data = bytearray(mutated_bytes(random, seeds, most=100_000) if random.random() < 0.5 else random.choice(seeds))
    for _ in range(random.randint(1, 4)):
        width, form = random.choice(((2, "H"), (4, "I"), (8, "Q")))
        number = random.choice(_NUMBERS) % (1 << 8 * width)
        # Headers are short, and most of what they say is at their beginning.
        place = random.randrange(min(len(data), random.choice((32, 300, 100_000))) or 1)
        data[place : place + width] = struct.pack(f"{random.choice('<>')}{form}", number)
    return bytes(data)


def _decodable_bytes(random: Random) -> bytes:
    """Return a picture whose header is whole, and whose pixels are not."""
    kind = random.choice(("png", "tiff", "jpeg"))
    data = bytearray(random.choice(pictures()[kind][:2]))
    for _ in range(random.randint(0, 3)):
        data[random.randrange(len(data) // 2, len(data))] = random.randrange(256)
    return bytes(data[: len(data) - random.choice((0, 0, 0, 5, 40))])


def _read_header(data: bytes) -> object:
    with _file(data) as path:
        header = read_header(path)
        return [read_header(path, page=page) for page in range(len(header.pages))]


def _decode(data: bytes) -> object:
    with _file(data) as path:
        return read_imported(path, at_most_px=10**6)


@contextmanager
def _file(data: bytes) -> Iterator[Path]:
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        file.write(data)
        file.flush()
        yield Path(file.name)


def _name_bytes(random: Random) -> bytes:
    return mutated_bytes(random, NAMES, most=250).replace(b"\0", b"").replace(b"/", b"") or b"a"


def _read_name(name: bytes) -> object:
    """Pack and check a folder that has a file of this name."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "scene.toml").write_bytes(MANIFEST)
        Path(folder, "s.pov").touch()
        if name not in (b".", b".."):
            Path(os.fsdecode(os.path.join(os.fsencode(folder), name))).touch()
        return check_bundle(pack_folder(Path(folder)))


@contextmanager
def _scene(text: bytes) -> Iterator[SceneFiles]:
    """Yield the files of a scene with this text."""
    with tempfile.TemporaryDirectory() as folder:
        bundle = Path(folder, "bundle")
        (bundle / "maps").mkdir(parents=True)
        for name in ("s.pov", "a.png", "maps/wood.inc"):
            (bundle / name).write_bytes(text)
        yield SceneFiles(bundle, "s.pov", ("maps",))


def _read_scene(data: bytes) -> object:
    with _scene(data) as files:
        files.make_links(files.bundle.parent / "links")
        return [files.missing(name) for name in data.decode(errors="replace").split('"')[1:4]]


def _read_output(data: bytes) -> object:
    """Read lines of POV-Ray, which a scene can make it print, with the places in the scene that they mean."""
    with _scene(SCENES[0]) as files:
        pov = files.bundle.parent / "lippmann-frame.pov"
        pov.write_text(FRAME)
        places = ScenePlaces(pov, files)
        lines = data.decode(errors="replace").splitlines()
        found = [places.translate(message) for message in read_messages(lines, roots=(files.bundle,))]
        wrong = [message for message in found if message.kind is not MessageKind.WARNING]
        return [(files.missing(message.text), with_hint(message, files)) for message in wrong[:1]]


FILE_READERS: Mapping[str, tuple[Make, Read]] = {
    **{
        f"picture.{kind}": (partial(_picture_bytes, kind), _read_header)
        for kind in ("png", "tiff", "jpeg", "exr", "pnm")
    },
    "file name": (_name_bytes, _read_name),
    "scene text": (lambda random: mutated_bytes(random, SCENES, most=300_000), _read_scene),
    "output": (lambda random: mutated_bytes(random, OUTPUTS, most=300_000), _read_output),
}
"""The makers of inputs and the readers, by name."""

DECODER: tuple[Make, Read] = (_decodable_bytes, _decode)
"""The decoder of pictures, which is a process of its own in the sandbox: a hundred times slower than the others."""
