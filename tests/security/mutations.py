"""Hostile texts: mutations of valid ones and structural bombs, each a function of a seeded random generator."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

MAX_REPEATED_BYTES = 2_000_000
PIECES = (
    *(b"[", b"]", b"{", b"}", b'"', b"'", b'"""', b"'''", b"\\", b"\\u0000", b"\\ud800", b"\\udc00", b"#", b"=", b"."),
    *(b",", b";", b":", b"\n", b"\r", b"\t", b"\0", b"\x1b[2J", b"\xff", b"\xef\xbb\xbf", b"\xe2\x80\xae", b"a.a.a."),
    *(
        b"NaN",
        b"inf",
        b"-inf",
        b"1e999",
        b"-0",
        b"1e-400",
        b"9" * 500,
        b"0x" + b"f" * 600,
        b"null",
        b"true",
        b"[[a]]\n",
    ),
)
NUMBERS = (0, -1, 1, 2**31, 2**63, 2**64, -(2**63) - 1, 10**300, 10**399, 0.5, -0.0, 5e-324, 1e308, -1e308, 1e15, 1e16)
TEXTS = (
    "",
    " ",
    "\0",
    "a" * 5000,
    "..",
    "/",
    "#20a0ff",
    "1-999999",
    "1-999999:0",
    "1,2,",
    "\N{ARABIC-INDIC DIGIT ONE}",
    "\N{RIGHT-TO-LEFT OVERRIDE}x",
    "fish",
    "1" * 999,
    "*" * 200,
    "[!" * 90,
    "(a+)+$",
    "{file}",
    "%s%n",
)


def mutated_bytes(random: Random, seeds: Sequence[bytes], *, most: int) -> bytes:
    """Return one of the seeds after some cuts, copies, splices and inserted pieces; `most` bytes at most."""
    data = random.choice(seeds)
    for _ in range(random.randint(1, 6)):
        change: Callable[[Random, bytes, Sequence[bytes]], bytes] = random.choice(_BYTE_CHANGES)
        data = change(random, data, seeds)[:most]
    return data


def mutated_value(random: Random, value: Any) -> Any:
    """Return a JSON value in which some parts were replaced, removed, copied or nested."""
    value = json.loads(json.dumps(value))
    for _ in range(random.randint(1, 4)):
        value = _changed(random, value)
    return value


def nasty_value(random: Random) -> Any:
    """Return a JSON value that few readers expect."""
    kind = random.randrange(9)
    if kind == 0:
        return random.choice(NUMBERS)
    if kind == 1:
        return random.choice(TEXTS)
    if kind == 2:
        return random.choice((None, True, False, [], {}, [[]], [{}]))
    if kind == 3:
        return [random.choice(NUMBERS) for _ in range(random.randint(1, 300))]
    if kind == 4:
        return _nested(random.randint(1, 60), [] if random.random() < 0.5 else {})
    if kind == 5:
        return {f"{random.choice(TEXTS)}{place}": 0 for place in range(random.randint(1, 300))}
    if kind == 6:
        return [random.choice(TEXTS)] * random.randint(1, 300)
    if kind == 7:
        return {"keyframes": [[place + 1, random.choice(NUMBERS)] for place in range(random.randint(1, 200))]}
    return [{}] * random.randint(1, 300)


def mutated_zip(random: Random, files: dict[str, bytes], *, most: int) -> bytes:
    """Return a zip of the files, some of them renamed, changed, added or removed, and its bytes changed at times."""
    changed = dict(files)
    for _ in range(random.randint(0, 3)):
        changed = _changed_files(random, changed)
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in changed.items():
            entry = zipfile.ZipInfo(name)
            entry.compress_type = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_DEFLATED))
            entry.external_attr = random.choice((0, 0o100644 << 16, 0o120777 << 16, 0o040755 << 16))
            archive.writestr(entry, content)
    packed = bytearray(data.getvalue())
    if random.random() < 0.7:
        for _ in range(random.randint(1, 4)):
            _damage_zip(random, packed)
    return bytes(packed[:most])


def _flip(random: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    changed = bytearray(data or b"a")
    changed[random.randrange(len(changed))] = random.randrange(256)
    return bytes(changed)


def _insert(random: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    place = random.randint(0, len(data))
    return data[:place] + random.choice(PIECES) + data[place:]


def _repeat_piece(random: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    place, count = random.randint(0, len(data)), random.choice((10, 100, 1000, 10_000, 100_000))
    pieces = b"".join(random.choice(PIECES) for _ in range(random.randint(1, 3)))
    return data[:place] + pieces * min(count, MAX_REPEATED_BYTES // len(pieces)) + data[place:]


def _repeat_part(random: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    start = random.randint(0, len(data))
    stop = min(len(data), start + random.randint(1, 60))
    return data[:stop] + data[start:stop] * random.choice((1, 10, 100, 1000, 10_000)) + data[stop:]


def _cut(random: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    start = random.randint(0, len(data))
    return data[:start] + data[start + random.randint(1, 40) :]


def _splice(random: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:
    other = random.choice(seeds)
    return data[: random.randint(0, len(data))] + other[random.randint(0, len(other)) :]


_BYTE_CHANGES = (_flip, _insert, _insert, _repeat_piece, _repeat_part, _cut, _splice)


def _nested(depth: int, inner: Any) -> Any:
    for _ in range(depth):
        inner = [inner] if isinstance(inner, list) else {"a": inner}
    return inner


def _places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [path]
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, part in items:
        found += _places(part, (*path, name))
    return found


def _changed(random: Random, value: Any) -> Any:
    places = _places(value)
    path = random.choice(places)
    if not path:
        return nasty_value(random) if random.random() < 0.1 else value
    above = value
    for name in path[:-1]:
        above = above[name]
    name = path[-1]
    kind = random.randrange(6)
    if kind == 0 and isinstance(above, dict):
        del above[name]
    elif kind == 1 and isinstance(above, dict):
        above[random.choice(TEXTS)] = nasty_value(random)
    elif kind == 2 and isinstance(above, list):
        above *= random.randint(2, 50)
    elif kind == 3:
        above[name] = [above[name]]
    elif kind == 4:
        other = value
        for step in random.choice(places):
            try:
                other = other[step]
            except (KeyError, IndexError, TypeError):
                break
        above[name] = json.loads(json.dumps(other))
    else:
        above[name] = nasty_value(random)
    return value


_NAMES = (
    "../a",
    "/a",
    "a//b",
    "a/./b",
    "a\\b",
    "A.inc",
    "NUL",
    "scene.toml/",
    "scene.inc/",
    ".povray/povray.conf",
    "d/" * 30 + "a",
    "a" * 250,
    "\N{RIGHT-TO-LEFT OVERRIDE}a",
    "a\x1bb",
    "e\u0301",
    "\xe9",
    " ",
    "a ",
    "poster.png",
    "lippmann-x.inc",
)


def _changed_files(random: Random, files: dict[str, bytes]) -> dict[str, bytes]:
    kind = random.randrange(4)
    if kind == 0:
        return {**files, random.choice(_NAMES): b"a" * random.choice((0, 1, 100_000))}
    if kind == 1:
        return {**files, "scene.toml": mutated_bytes(random, [files.get("scene.toml", b"")], most=300_000)}
    if kind == 2:
        return {**files, **{f"{random.choice(_NAMES)}{number}": b"" for number in range(random.choice((3, 300)))}}
    left = random.choice(list(files) or ["a"])
    return {name: content for name, content in files.items() if name != left}


def _damage_zip(random: Random, data: bytearray) -> None:
    """Change one field of a header, or any byte."""
    mark, fields = random.choice(
        (
            (
                b"PK\x03\x04",
                ((4, "<H"), (6, "<H"), (8, "<H"), (14, "<I"), (18, "<I"), (22, "<I"), (26, "<H"), (28, "<H")),
            ),
            (
                b"PK\x01\x02",
                (
                    (6, "<H"),
                    (8, "<H"),
                    (10, "<H"),
                    (16, "<I"),
                    (20, "<I"),
                    (24, "<I"),
                    (28, "<H"),
                    (30, "<H"),
                    (32, "<H"),
                    (38, "<I"),
                    (42, "<I"),
                ),
            ),
            (b"PK\x05\x06", ((8, "<H"), (10, "<H"), (12, "<I"), (16, "<I"), (20, "<H"))),
        )
    )
    place = data.find(mark, random.randrange(max(1, len(data))))
    if place < 0 or random.random() < 0.2:
        data[random.randrange(len(data))] = random.randrange(256)
        return
    offset, form = random.choice(fields)
    if place + offset + struct.calcsize(form) <= len(data):
        top = 0xFFFF if form == "<H" else 0xFFFFFFFF
        struct.pack_into(
            form, data, place + offset, random.choice((0, 1, 8, 255, top, top - 1, random.randint(0, top)))
        )
