"""Names of files in a scene: links for those in another case, and what is said of a file that is not found."""

from __future__ import annotations

from pathlib import Path

import pytest

from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.engines.povray.scenes import scene_files
from worker.engines.povray.scenes.scene_files import SceneFiles
from worker.sandbox.bundle import listing_of

OE = "\N{LATIN SMALL LETTER O WITH DIAERESIS}"
FILES = ("Parts.inc", "maps/wood.png", "models/trees/oak.inc", "models/Leaf.png", f"H{OE}lz/{OE}l.png", f"b{OE}d.inc")


def scene(folder: Path, text: str, *, include: tuple[str, ...] = ()) -> SceneFiles:
    """Return the files of a bundle with a scene in a folder of its own."""
    bundle = folder / "bundle"
    for name in FILES:
        (bundle / name).parent.mkdir(parents=True, exist_ok=True)
        (bundle / name).write_bytes(b"\0")
    (bundle / "old").mkdir()
    (bundle / "old" / "s.pov").write_bytes(text.encode())
    return SceneFiles(bundle, "old/s.pov", include)


def links(folder: Path, text: str, *, include: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the links that are made for a scene, with the files behind them from the top of the bundle."""
    made = folder / "links"
    scene(folder, text, include=include).make_links(made)
    found = {path.relative_to(made).as_posix(): path.readlink() for path in made.rglob("*") if path.is_symlink()}
    assert all(path.is_file() for path in found.values())
    return {
        name: str(path.relative_to(folder / "bundle" if SYSTEM_INCLUDE not in path.parents else SYSTEM_INCLUDE.parent))
        for name, path in found.items()
    }


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('#include "PARTS.INC"', {"PARTS.INC": "Parts.inc"}),
        ('#include "parts"', {"parts": "Parts.inc"}),
        (r'png "Maps\WOOD.PNG"', {r"Maps\WOOD.PNG": "maps/wood.png"}),
        (r'#declare F = "maps\\wood.png";', {r"maps\\wood.png": "maps/wood.png", r"maps\wood.png": "maps/wood.png"}),
        ('png "./Maps//Wood.png"', {"Maps/Wood.png": "maps/wood.png"}),
        ('// 6" long\n// 6" wide, see "Maps/Wood.png"', {"Maps/Wood.png": "maps/wood.png"}),
        ('#include "Parts.inc" png "maps/wood.png"', {}),
        ('png "wood.png"', {}),
        ('png "../Maps/wood.png" png "/etc/HOSTNAME" png "" png "Maps"', {}),
        ('png "LEAF.PNG"', {}),
        (f'#include "b{OE}d"', {"b  d": f"b{OE}d.inc", "b d": f"b{OE}d.inc"}),
        (f'png "h{OE}lz\\{OE}L.png"', {f"h{n}lz\\{n}L.png": f"H{OE}lz/{OE}l.png" for n in ("  ", " ")}),
    ],
)
def test_a_name_in_another_case_or_with_backslashes_is_a_link(
    tmp_path: Path, text: str, expected: dict[str, str]
) -> None:
    assert links(tmp_path, text) == expected


def test_a_name_is_looked_for_in_the_folders_of_the_manifest(tmp_path: Path) -> None:
    text = 'png "LEAF.PNG" #include "Trees/Oak.inc"'
    assert links(tmp_path, text, include=("models",)) == {
        "LEAF.PNG": "models/Leaf.png",
        "Trees/Oak.inc": "models/trees/oak.inc",
    }


@pytest.mark.skipif(not SYSTEM_INCLUDE.is_dir(), reason="POV-Ray is not installed")
def test_an_include_of_povray_is_found_in_another_case(tmp_path: Path) -> None:
    assert links(tmp_path, '#include "Colors.INC"\n#include "colors.inc"') == {"Colors.INC": "include/colors.inc"}


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_a_name_outside_ascii_is_found_in_the_encoding_of_the_scene(tmp_path: Path, encoding: str) -> None:
    files = scene(tmp_path, "")
    (files.bundle / "old" / "s.pov").write_bytes(f'#include "b{OE}d.inc"'.encode(encoding))
    files.make_links(tmp_path / "links")
    assert {path.name for path in (tmp_path / "links").iterdir()} == (
        {"b  d.inc", "b d.inc"} if encoding == "utf-8" else {"b d.inc"}
    )


def test_two_names_that_povray_reads_alike_have_no_link_and_the_message_says_so(tmp_path: Path) -> None:
    files = scene(tmp_path, f'#include "b{OE}d.inc" #include "b\N{LATIN SMALL LETTER U WITH DIAERESIS}d.inc"')
    (files.bundle / "b\N{LATIN SMALL LETTER U WITH DIAERESIS}d.inc").write_bytes(b"\0")
    files.make_links(tmp_path / "links")
    assert list((tmp_path / "links").iterdir()) == []
    assert "POV-Ray reads a letter outside ASCII as a blank, so give the file a name" in files.missing("b  d.inc")


def test_a_scene_file_outside_ascii_has_a_link(tmp_path: Path) -> None:
    (tmp_path / f"W{OE}rfel.pov").write_bytes(b"")
    files = SceneFiles(tmp_path, f"W{OE}rfel.pov")
    files.make_links(tmp_path / "links")
    assert files.own_name("lippmann-scene.pov") == f"W{OE}rfel.pov"
    assert (tmp_path / "links" / "lippmann-scene.pov").resolve() == tmp_path / f"W{OE}rfel.pov"


def test_a_scene_whose_name_reads_like_that_of_its_include_has_links_for_both(tmp_path: Path) -> None:
    (tmp_path / "場景.inc").write_text('#include "材質.inc"')
    (tmp_path / "材質.inc").write_bytes(b"")
    files = SceneFiles(tmp_path, "場景.inc")
    files.make_links(tmp_path / "links")
    assert (tmp_path / "links" / "lippmann-scene.inc").resolve() == tmp_path / "場景.inc"
    assert (tmp_path / "links" / "      .inc").resolve() == tmp_path / "材質.inc"


def test_links_are_made_once(tmp_path: Path) -> None:
    files = scene(tmp_path, '"PARTS.INC" "PARTS.INC/a"')
    for _ in range(2):
        files.make_links(tmp_path / "links")
    assert [path.name for path in (tmp_path / "links").iterdir()] == ["PARTS.INC"]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("oak.inc", "the bundle has 'models/trees/oak.inc': add include = [\"models/trees\"] to scene.toml"),
        ("trees/oak.inc", "the bundle has 'models/trees/oak.inc': add include = [\"models\"] to scene.toml"),
        ("Trees/OAK.inc", "the bundle has 'models/trees/oak.inc': add include = [\"models\"] to scene.toml"),
        ("PARTS.inc", "the bundle has 'Parts.inc': name the file so in the scene"),
        ("textures/wood.png", "the bundle has 'maps/wood.png': name the file so in the scene"),
        (r"C:\scenes\wood.png", "the bundle has 'maps/wood.png': name the file so in the scene"),
        ("leaf", "no file 'leaf' in the scene bundle"),
        ("elm.inc", "no file 'elm.inc' in the scene bundle"),
    ],
)
def test_a_file_that_is_not_found_is_named_with_the_one_that_is_there(tmp_path: Path, name: str, expected: str) -> None:
    assert expected in scene(tmp_path, "").missing(name)


def test_a_link_has_the_name_of_its_file_in_messages(tmp_path: Path) -> None:
    files = scene(tmp_path, '#include "PARTS.INC"')
    assert [files.own_name(name) for name in ("PARTS.INC", "old/s.pov")] == ["Parts.inc", "old/s.pov"]


def test_what_was_read_of_a_damaged_bundle_is_not_kept(tmp_path: Path) -> None:
    files = scene(tmp_path, '"Maps/WOOD.png"')
    (files.bundle / "maps" / "wood.png").rename(tmp_path / "away")
    files.make_links(tmp_path / "before")
    (tmp_path / "away").rename(files.bundle / "maps" / "wood.png")
    files.make_links(tmp_path / "after")
    assert (list((tmp_path / "before").iterdir()), (tmp_path / "after" / "Maps" / "WOOD.png").is_file()) == ([], True)


def test_the_files_of_a_scene_are_listed_once_for_any_number_of_messages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files, listed = scene(tmp_path, 'png "Maps/WOOD.png"'), list[Path]()

    def listing(folder: Path) -> str:
        listed.append(folder)
        return listing_of(folder)

    monkeypatch.setattr(scene_files, "listing_of", listing)
    names = [files.own_name("Maps/WOOD.png") for _ in range(100)]
    assert set(names) == {"maps/wood.png"}
    assert len(listed) <= 2, "before and after the texts are read"
