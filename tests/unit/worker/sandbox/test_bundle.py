"""Zips from strangers: refused by name, without being unpacked first."""

from __future__ import annotations

import io
import re
import stat
import tracemalloc
import zipfile
from pathlib import Path

import pytest

from lippmann.errors import BundleError
from lippmann.untrusted.zip_archive import MAX_BYTES, MAX_FILES
from povtemplates.catalogue import scene_folders
from worker.sandbox.bundle import check_bundle, listing_of, pack_folder, unpack

SCENE_TOML = (scene_folders()["target-white"] / "scene.toml").read_bytes()


def zipped(files: dict[str, bytes], *, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", method) as archive:
        for name, content in {"scene.inc": b"", "scene.toml": SCENE_TOML, **files}.items():
            archive.writestr(name, content)
    return data.getvalue()


def test_a_right_zip_is_taken() -> None:
    assert check_bundle(zipped({"textures/a.png": b"a"})).card.title


@pytest.mark.promise("Scenes", "A name in a bundle does not lead out of its folder.")
@pytest.mark.parametrize(
    "name",
    ["../out", "/etc/passwd", "a/../../out", "..\\out", "\\etc\\passwd", f"{'x' * 201}.png"],
    ids=["up", "root", "in", "back", "back root", "long"],
)
def test_a_name_that_leads_out_or_does_not_fit_is_refused(name: str) -> None:
    with pytest.raises(BundleError, match="expected names"):
        check_bundle(zipped({name: b"a"}))


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_name_that_is_file_and_folder_is_refused() -> None:
    with pytest.raises(BundleError, match="both as a file and as a folder"):
        check_bundle(zipped({"a": b"a", "a/b": b"b"}))


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_name_that_comes_twice_is_refused() -> None:
    data = io.BytesIO(zipped({"a": b"a"}))
    with zipfile.ZipFile(data, "a") as archive:
        archive.writestr("a", b"b")
    with pytest.raises(BundleError, match="expected every name once"):
        check_bundle(data.getvalue())


def test_a_link_in_a_zip_is_refused() -> None:
    data = io.BytesIO(zipped({}))
    link = zipfile.ZipInfo("skin.png")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(data, "a") as archive:
        archive.writestr(link, "/etc/hostname")
    with pytest.raises(BundleError, match=r"expected plain files, got a link: 'skin\.png'"):
        check_bundle(data.getvalue())


def test_too_many_files_are_refused() -> None:
    check_bundle(zipped({f"{number}.inc": b"" for number in range(MAX_FILES - 2)}))
    with pytest.raises(BundleError, match=f"expected at most {MAX_FILES} files, got {MAX_FILES + 1}"):
        check_bundle(zipped({f"{number}.inc": b"" for number in range(MAX_FILES - 1)}))


def test_files_that_are_too_large_together_are_refused_before_they_are_unpacked() -> None:
    """Each of two files says that it has 200 MiB, which alone would be allowed."""
    honest = zipped({"a": bytes(12_345), "b": bytes(12_345)})
    size = 200 * 2**20
    large = honest.replace((12_345).to_bytes(4, "little"), size.to_bytes(4, "little"))
    with pytest.raises(BundleError, match=f"at most {MAX_BYTES} bytes unpacked, got {2 * size + len(SCENE_TOML)}"):
        check_bundle(large)


def test_other_compressions_are_refused() -> None:
    with pytest.raises(BundleError, match="stored or deflated"):
        check_bundle(zipped({}, method=zipfile.ZIP_BZIP2))


def test_a_zip_that_lies_about_its_sizes_costs_no_memory() -> None:
    """10 MB of zeros that say they are 10 bytes; a few kilobytes as a zip."""
    honest = zipped({"bomb": bytes(10_000_000)})
    lying = honest.replace((10_000_000).to_bytes(4, "little"), (10).to_bytes(4, "little"))
    assert lying != honest
    tracemalloc.start()
    with pytest.raises(BundleError, match="bomb: "):
        check_bundle(lying)
    assert tracemalloc.get_traced_memory()[1] < 2_000_000
    tracemalloc.stop()


def test_a_damaged_file_is_named() -> None:
    data = bytearray(zipped({"skin.png": b"0123456789" * 10}, method=zipfile.ZIP_STORED))
    data[data.index(b"0123456789") + 3] ^= 0xFF
    with pytest.raises(BundleError, match=r"skin\.png: damaged in the zip"):
        check_bundle(bytes(data))


def test_a_link_that_leads_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(SCENE_TOML)
    (tmp_path / "scene.inc").symlink_to("/etc/hostname")
    with pytest.raises(BundleError, match="a link that leads out"):
        pack_folder(tmp_path)


@pytest.mark.parametrize(("target", "message"), [("maps", "got a link to one: .*link"), ("gone", "a link to nothing")])
def test_a_link_to_a_folder_or_to_nothing_is_refused(tmp_path: Path, target: str, message: str) -> None:
    (tmp_path / "scene.toml").write_bytes(SCENE_TOML)
    (tmp_path / "maps").mkdir()
    (tmp_path / "link").symlink_to(target)
    with pytest.raises(BundleError, match=message):
        pack_folder(tmp_path)


@pytest.mark.parametrize(
    ("manifest", "message"),
    [
        ("scene.toml", f"expected a folder of at most {MAX_BYTES} bytes"),
        ("Scene.toml", r"expected scene\.toml at the top of the bundle, got it at 'Scene\.toml'"),
        ("scene.toml.txt", r"expected scene\.toml at the top of the bundle, got film\.mkv, scene\.toml\.txt"),
        ("balls/scene.toml", r"expected scene\.toml at the top of the bundle, got it at 'balls/scene\.toml'"),
    ],
)
def test_a_folder_that_is_no_bundle_is_refused_before_its_files_are_read(
    tmp_path: Path, manifest: str, message: str
) -> None:
    with (tmp_path / "film.mkv").open("wb") as film:
        film.truncate(1024 * MAX_BYTES)
    (tmp_path / manifest).parent.mkdir(exist_ok=True)
    (tmp_path / manifest).write_bytes(SCENE_TOML)
    with pytest.raises(BundleError, match=message):
        pack_folder(tmp_path)


def test_a_folder_in_a_folder_of_its_own_is_a_bundle(tmp_path: Path) -> None:
    data = packed(tmp_path, {"balls/scene.toml": SCENE_TOML, "balls/scene.inc": b""})
    assert check_bundle(data).notes == ("the bundle is the folder 'balls' of the zip",)


@pytest.mark.parametrize("encoding", ["utf-8", "cp437"], ids=["macOS", "Windows"])
def test_a_name_of_a_zip_that_does_not_say_its_encoding_is_read(tmp_path: Path, encoding: str) -> None:
    """`zipfile` writes such a name as UTF-8 and says so, in the flags beside it."""
    data = bytearray(zipped({"maps/K\N{LATIN SMALL LETTER O WITH DIAERESIS}lle.png": b"a"}, method=zipfile.ZIP_STORED))
    for flags, start in ((6, b"PK\3\4"), (8, b"PK\1\2")):
        for found in [match.start() for match in re.finditer(re.escape(start), data)]:
            data[found + flags + 1] &= 0xFF - 0x08
    if encoding == "cp437":
        data = data.replace("\N{LATIN SMALL LETTER O WITH DIAERESIS}".encode(), b"\x94l")  # The length stays.
    unpack(bytes(data), tmp_path)
    assert [path.name[:2] for path in (tmp_path / "maps").iterdir()] == ["K\N{LATIN SMALL LETTER O WITH DIAERESIS}"]


def test_a_manifest_may_name_a_file_by_composed_accents(tmp_path: Path) -> None:
    composed, apart = "K\N{LATIN SMALL LETTER O WITH DIAERESIS}lle.pov", "Ko\N{COMBINING DIAERESIS}lle.pov"
    manifest = OWN.replace(b"old/wood box.pov", composed.encode())
    assert check_bundle(zipped({"scene.toml": manifest, apart: b""})).card.file == apart


def test_what_is_unpacked_is_what_was_packed(tmp_path: Path) -> None:
    unpack(zipped({"textures/a.png": b"abc"}), tmp_path)
    assert (tmp_path / "textures" / "a.png").read_bytes() == b"abc"


OWN = b"""file = "old/wood box.pov"
[stage]
location = [0, 0, -20]
look_at = [0, 0, 0]
near_mm = 1000
far_mm = 2000
mm_per_unit = 50
"""


def zipped_as_they_are(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return data.getvalue()


WRAPPED = {"scene-main/scene.toml": SCENE_TOML, "scene-main/scene.inc": b"", "scene-main/maps/a.png": b"a"}
CLUTTER = {
    "__MACOSX/scene-main/._scene.inc": b"\0",
    "scene-main/.DS_Store": b"\0",
    "scene-main/maps/Thumbs.db": b"",
    "scene-main/.git/config": b"",
}


@pytest.mark.parametrize(
    ("files", "notes"),
    [
        (WRAPPED, ["the bundle is the folder 'scene-main' of the zip"]),
        ({"scene-main/": b""} | WRAPPED, ["the bundle is the folder 'scene-main' of the zip"]),
        (
            WRAPPED | CLUTTER,
            [
                "the zip also has files that no scene uses: __MACOSX/.*",
                "the bundle is the folder 'scene-main' of the zip",
            ],
        ),
        ({f"a/{name}": content for name, content in WRAPPED.items()}, ["the bundle is the folder 'a/scene-main' .*"]),
        ({name.replace("/", "\\"): content for name, content in WRAPPED.items()}, ["the bundle .* 'scene-main' .*"]),
        ({name.removeprefix("scene-main/"): content for name, content in WRAPPED.items()}, []),
    ],
    ids=["one folder", "listed folder", "macOS and Windows", "folder in folder", "backslashes", "none"],
)
def test_the_only_top_folder_of_a_zip_is_the_bundle(tmp_path: Path, files: dict[str, bytes], notes: list[str]) -> None:
    data = zipped_as_they_are(files)
    checked = check_bundle(data)
    assert checked.card.file == "scene.inc"
    assert len(checked.notes) == len(notes)
    assert all(re.fullmatch(expected, note) for expected, note in zip(notes, checked.notes, strict=True))
    unpack(data, tmp_path)
    found = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert found == {"scene.toml", "scene.inc", "maps/a.png"}


def test_files_of_systems_count_for_no_limit() -> None:
    beside = {f"__MACOSX/scene-main/._{number}.inc": b"" for number in range(MAX_FILES - 3)}
    files = {f"scene-main/{number}.inc": b"" for number in range(MAX_FILES - 3)}
    check_bundle(zipped_as_they_are(WRAPPED | files | beside))


def test_a_manifest_in_one_of_several_folders_is_refused_with_its_place() -> None:
    files = WRAPPED | {"readme.txt": b""}
    with pytest.raises(BundleError, match=r"at the top of the bundle, got it at 'scene-main/scene\.toml'"):
        check_bundle(zipped_as_they_are(files))


def test_what_systems_put_into_a_folder_stays_out(tmp_path: Path) -> None:
    scene = {name.removeprefix("scene-main/"): content for name, content in WRAPPED.items()}
    clutter = {"Thumbs.db": b"", "maps/desktop.ini": b"", "._a.inc": b""}
    assert packed(tmp_path / "with", scene | clutter) == packed(tmp_path / "without", scene)


def packed(folder: Path, files: dict[str, bytes]) -> bytes:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return pack_folder(folder)


def test_two_that_unpack_a_bundle_make_one_listing_and_a_change_makes_another(tmp_path: Path) -> None:
    data, folders = zipped({"a.pov": b"//", "b/c.inc": b""}), [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
        unpack(data, folder)
    one, two = folders
    assert listing_of(one) == listing_of(two)
    (one / "a.pov").write_bytes(b"##")
    (two / "b" / "c.inc").unlink()
    assert len({listing_of(one), listing_of(two), listing_of(tmp_path)}) == 3


def test_texts_are_unpacked_without_their_byte_order_mark(tmp_path: Path) -> None:
    mark = b"\xef\xbb\xbf"
    data = zipped({"a.pov": mark + b"#version 3.7;", "b.inc": b"//" + mark, "c.inc": mark[:2]})
    unpack(data, tmp_path)
    found = {name: (tmp_path / name).read_bytes() for name in ("a.pov", "b.inc", "c.inc")}
    assert found == {"a.pov": b"#version 3.7;", "b.inc": b"//" + mark, "c.inc": mark[:2]}


def test_a_manifest_may_have_a_byte_order_mark_and_name_a_file_and_folders_in_another_case() -> None:
    manifest = b'\xef\xbb\xbfinclude = ["Models/Trees/", "fonts"]\n' + OWN
    files = {"scene.toml": manifest, "Old/Wood Box.POV": b"", "models/trees/a.inc": b"", "fonts/b.ttf": b""}
    card = check_bundle(zipped(files)).card
    assert (card.file, card.include) == ("Old/Wood Box.POV", ("models/trees", "fonts"))


def test_an_include_folder_that_is_not_in_the_bundle_is_refused_with_those_that_are() -> None:
    manifest = b'include = ["models"]\n' + OWN
    message = r"include: expected a folder that is in the bundle, got 'models'; there are maps, maps/wood, old"
    with pytest.raises(BundleError, match=message):
        check_bundle(zipped({"scene.toml": manifest, "old/wood box.pov": b"", "maps/wood/a.png": b""}))


def test_a_scene_toml_may_name_any_file_of_the_bundle(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "wood box.pov").write_text("sphere { 0, 1 }")
    (tmp_path / "scene.toml").write_bytes(OWN)
    assert check_bundle(pack_folder(tmp_path)).card.file == "old/wood box.pov"


def test_a_named_file_that_is_not_in_the_bundle_is_refused_with_those_that_are() -> None:
    message = r"file: expected one that is in the bundle, got 'old/wood box\.pov'; there are scene\.inc, woodbox\.pov, "
    with pytest.raises(BundleError, match=message):
        check_bundle(zipped({"scene.toml": OWN, "woodbox.pov": b"", "a.png": b""}))


@pytest.mark.parametrize("name", ["lippmann-rays.inc", "LIPPMANN-Frame.pov", "old/lippmann-picture.exr"])
def test_a_name_that_a_worker_s_own_files_have_is_refused_where_povray_looks(name: str) -> None:
    with pytest.raises(BundleError, match=f"expected no name .* 'lippmann-', got '{name}'"):
        check_bundle(zipped({"scene.toml": OWN, "old/wood box.pov": b"", name: b""}))


@pytest.mark.parametrize("name", ["lippmann/stage.inc", "pictures/lippmann-logo.png", "rays.inc"])
def test_any_other_name_of_ours_is_free(name: str) -> None:
    assert check_bundle(zipped({"scene.toml": OWN, "old/wood box.pov": b"", name: b""})).card.file


def test_without_a_name_the_scene_is_scene_inc(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(SCENE_TOML)
    (tmp_path / "woodbox.pov").write_text("")
    with pytest.raises(BundleError, match=r"got 'scene\.inc'; there are woodbox\.pov"):
        check_bundle(pack_folder(tmp_path))
