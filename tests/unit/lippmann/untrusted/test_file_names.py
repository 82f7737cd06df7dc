"""Names of files from strangers: what no file system confuses passes, all else is refused."""

from __future__ import annotations

import pytest

from lippmann.errors import BundleError
from lippmann.untrusted.file_names import MAX_DEPTH, MAX_FOLDERS, check_names


@pytest.mark.parametrize(
    "name",
    [
        "scene.inc",
        "textures/wood box.png",
        "Größe/日本語.png",
        "__MACOSX/._scene.inc",
        ".DS_Store",
        "console.inc",
        "nullify/aux_light.inc",
        "x" * 200,
        "/".join("d" * MAX_DEPTH),
    ],
)
def test_an_honest_name_passes(name: str) -> None:
    check_names([name])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("../out", "names inside the bundle"),
        ("/etc/passwd", "names inside the bundle"),
        ("a/./b", "names inside the bundle"),
        ("a//b", "names inside the bundle"),
        ("a\\b", "names inside the bundle"),
        ("", "names inside the bundle"),
        ("scene.toml/", "names inside the bundle"),
        ("a\nb", "names without control characters"),
        ("a\x00b", "names without control characters"),
        ("a\x1b[2Jb", "names without control characters"),
        ("gpj.\N{RIGHT-TO-LEFT OVERRIDE}vop.png", "names without control characters and marks of direction"),
        ("a\N{ZERO WIDTH SPACE}b", "names without control characters and marks of direction"),
        ("a\ud800b", "names without control characters"),
        ("x" * 201, "names of at most 200 bytes"),
        ("ü" * 101, "names of at most 200 bytes"),
        ("x/" * 501, "names of at most 1000 bytes"),
        ("/".join("d" * (MAX_DEPTH + 1)), "names of at most 16 parts"),
        ("NUL", "names that are no devices of Windows"),
        ("textures/aux.inc", "names that are no devices of Windows"),
        ("com1.tar.gz", "names that are no devices of Windows"),
        (".povray/3.7/povray.conf", "no hidden settings of POV-Ray"),
        ("a/.POVRAYrc", "no hidden settings of POV-Ray"),
    ],
)
def test_a_name_that_may_mislead_is_refused(name: str, expected: str) -> None:
    with pytest.raises(BundleError, match=f"^expected {expected}"):
        check_names([name])
    with pytest.raises(BundleError, match=f"^expected {expected}"):
        check_names([], [name])


@pytest.mark.parametrize(
    "names",
    [
        ("Wood.png", "wood.png"),
        ("caf\N{LATIN SMALL LETTER E WITH ACUTE}.png", "cafe\N{COMBINING ACUTE ACCENT}.png"),
        ("Textures/a.png", "textures"),
        ("stra\N{LATIN SMALL LETTER SHARP S}e.png", "STRASSE.png"),
    ],
)
def test_names_that_a_file_system_may_take_for_one_are_refused(names: tuple[str, str]) -> None:
    with pytest.raises(BundleError, match="differ by more than case and the composition of accents"):
        check_names(names)


def test_a_listed_folder_and_its_parts_are_no_conflict() -> None:
    check_names(["a/b/c.inc"], ["a", "a/b", "empty"])


def test_a_file_with_the_name_of_a_listed_folder_is_refused() -> None:
    with pytest.raises(BundleError, match="both as a file and as a folder"):
        check_names(["scene.toml"], ["scene.toml"])


def test_too_many_folders_are_refused() -> None:
    check_names([f"{number}/a" for number in range(MAX_FOLDERS)])
    with pytest.raises(BundleError, match="at most 1,000 folders, got 1,001"):
        check_names([f"{number}/a" for number in range(MAX_FOLDERS + 1)])
