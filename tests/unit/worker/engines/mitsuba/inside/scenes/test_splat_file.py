"""Gaussian splats are read from .ply files within limits, and hostile files are refused by what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import SceneError
from tests.unit.worker.engines.mitsuba.inside.scenes.splat_text import write_splats
from worker.engines.mitsuba.inside.scenes.splat_file import MAX_SPLATS, is_splats, read_splats


@pytest.fixture
def file(tmp_path: Path) -> Path:
    rest = np.arange(18).reshape(2, 9) / 100
    return write_splats(
        tmp_path / "two.ply",
        [[1, 2, 3], [4, 5, 6]],
        [[0.1, 0.2, 0.3], [1, 1, 1e-7]],
        opacities=[0.25, 0.75],
        colours=[[0.5, 0.6, 0.7], [1, 1, 1]],
        rotations=[[2, 0, 0, 0], [0, 0, 0, -3]],
        rest=rest,
    )


def test_every_number_is_decoded(file: Path) -> None:
    splats = read_splats(file)
    assert is_splats(file)
    assert len(splats) == 2
    assert splats.degree == 1
    np.testing.assert_allclose(splats.centers, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(splats.sigmas[0], [0.1, 0.2, 0.3], rtol=1e-5)
    np.testing.assert_allclose(splats.sigmas[1], [1, 1, 1e-3], rtol=1e-5)
    np.testing.assert_allclose(splats.opacities, [0.25, 0.75], rtol=1e-5)
    np.testing.assert_allclose(splats.quaternions, [[0, 0, 0, 1], [0, 0, -1, 0]])
    # All functions of red come first.
    np.testing.assert_allclose(splats.harmonics[0, 1:], np.array([[0, 3, 6], [1, 4, 7], [2, 5, 8]]) / 100, atol=1e-7)
    np.testing.assert_allclose(splats.harmonics[0, 0] * 0.28209479 + 0.5, [0.5, 0.6, 0.7], rtol=1e-5)


def test_more_properties_in_any_order_and_other_elements_are_allowed(file: Path) -> None:
    head, _, body = file.read_bytes().partition(b"end_header\n")
    rows = np.frombuffer(body, "<f4").reshape(2, -1)
    lines = head.decode().splitlines()
    names = lines[3:]
    order = [*range(5, len(names)), *range(5)]
    lines = ["ply", "comment x", *lines[1:3], "property uchar label", *(names[i] for i in order), "element camera 9"]
    text = "\r\n".join([*lines, "property list uchar int ids", "end_header", ""]).encode()
    file.write_bytes(text + b"".join(b"\x07" + row[order].tobytes() for row in rows) + b"tail")
    np.testing.assert_allclose(read_splats(file).centers, [[1, 2, 3], [4, 5, 6]])


def test_a_mesh_is_no_splats(tmp_path: Path) -> None:
    mesh = tmp_path / "mesh.ply"
    mesh.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n")
    assert not is_splats(mesh)
    assert not is_splats(tmp_path / "model.glb")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"ply\n", b"plx\n", "expected a .ply header of at most 16384 bytes, got none"),
        (b"end_header", b"end_heade_", "expected a .ply header"),
        (b"end_header", b"comment " + b"x" * 20_000 + b"\nend_header", "expected a .ply header of at most 16384"),
        (b"binary_little", b"binary_big", "expected format binary_little_endian 1.0, got binary_big_endian 1.0"),
        (b"element vertex 2", b"element chunk 2", "the element vertex first, not a compressed layout, got .*chunk"),
        (b"element vertex 2", b"element vertex 3", r"expected \d+ bytes for 3 splats, got \d+ bytes"),
        (b"element vertex 2", b"element vertex 0", f"expected 1 to {MAX_SPLATS} splats, got 0"),
        (b"element vertex 2", b"element vertex -2", f"expected 1 to {MAX_SPLATS} splats, got -2"),
        (b"element vertex 2", b"element vertex 1000000000", f"1 to {MAX_SPLATS} splats, got 1000000000"),
        (b"element vertex 2", b"element vertex " + b"9" * 5000, f"1 to {MAX_SPLATS} splats, got 9999"),
        (b"float opacity", b"float opacitx", "the properties of 3D Gaussian Splatting, got no opacity"),
        (b"float x", b"list uchar int x", "properties of one number, each once, got 'property list uchar int x'"),
        (b"float x", b"half x", "properties of one number, each once, got 'property half x'"),
        (b"float y", b"float x", "properties of one number, each once, got 'property float x'"),
        (b"float f_rest_8", b"float f_rust_8", "0, 9, 24 or 45 properties f_rest_0 .. .*, got 8"),
        (b"float f_rest_8", b"float f_rest_9", "0, 9, 24 or 45 properties f_rest_0"),
        (b"end_header", b"".join(b"property float a%d\n" % i for i in range(90)) + b"end_header", "at most 100 prop"),
    ],
)
def test_a_wrong_header_is_refused(file: Path, old: bytes, new: bytes, message: str) -> None:
    data = file.read_bytes()
    assert old in data
    file.write_bytes(data.replace(old, new, 1))
    with pytest.raises(SceneError, match=message):
        read_splats(file)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("x", np.nan, "x from -1e.06 to 1e.06, got nan in splat 1"),
        ("z", np.inf, "z from .* got inf in splat 1"),
        ("y", 2e6, "y from .* got 2000000.0 in splat 1"),
        ("scale_2", 20, "scale_2 from -10000 to 14, got 20.0 in splat 1"),
        ("opacity", np.nan, "opacity from .* got nan"),
        ("f_rest_4", -np.inf, "f_rest_4 from .* got -inf"),
        ("f_dc_1", 1e30, "f_dc_1 from"),
        ("rot_3", 0, "a quaternion with a length, got .0.0, 0.0, 0.0, -?0.0. in splat 1"),
    ],
)
def test_a_value_that_no_splat_has_is_refused(file: Path, name: str, value: float, message: str) -> None:
    head, mark, body = file.read_bytes().partition(b"end_header\n")
    names = [line.split()[-1] for line in head.decode().splitlines()[3:]]
    rows = np.frombuffer(body, "<f4").reshape(2, -1).copy()
    rows[1, names.index(name)] = value
    file.write_bytes(head + mark + rows.tobytes())
    with pytest.raises(SceneError, match=f"two.ply: expected .*{message}"):
        read_splats(file)


def test_spz_is_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "scene.spz"
    file.write_bytes(b"\x1f\x8b\x08rest")
    assert is_splats(file)
    with pytest.raises(SceneError, match=r"scene.spz: expected splats as .ply, got an .spz file"):
        read_splats(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"none.ply: expected a file that can be read"):
        read_splats(tmp_path / "none.ply")
