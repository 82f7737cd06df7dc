"""Zips from strangers: limits on entries, sizes, ratio and forms."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from lippmann.errors import BundleError
from lippmann.untrusted import zip_archive
from lippmann.untrusted.zip_archive import MAX_ENTRIES, open_archive


def zipped(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return data.getvalue()


def patched(data: bytes, *, local: int, central: int, value: int) -> bytes:
    """Return a zip whose headers have another byte at these offsets."""
    changed = bytearray(data)
    for mark, offset in ((b"PK\x03\x04", local), (b"PK\x01\x02", central)):
        changed[changed.index(mark) + offset] = value
    return bytes(changed)


def refused(data: bytes) -> str:
    with pytest.raises(BundleError) as found, open_archive(data) as archive:
        archive.verify()
    return found.value.message


def test_what_is_extracted_is_what_was_packed(tmp_path: Path) -> None:
    files = {"scene.inc": b"sphere {}", "textures/empty": b"", "textures/big.df3": bytes(1_000_000)}
    with open_archive(zipped(files)) as archive:
        archive.verify()
        archive.extract(tmp_path)
    assert {name: (tmp_path / name).read_bytes() for name in files} == files


@pytest.mark.parametrize("flag", [0x01, 0x20, 0x40], ids=["encrypted", "patch", "strongly encrypted"])
def test_an_entry_that_cannot_be_read_is_refused(flag: int) -> None:
    data = patched(zipped({"a": b"a"}), local=6, central=8, value=flag)
    assert refused(data) == "a: expected it stored or deflated, and neither encrypted nor a patch"


def test_a_version_that_does_not_exist_is_refused() -> None:
    assert "zip file version 25.5" in refused(patched(zipped({"a": b"a"}), local=4, central=6, value=255))


@pytest.mark.parametrize("cut", [0, 1, 10, 30, 60, 90])
def test_a_zip_that_was_cut_short_is_refused(cut: int) -> None:
    assert refused(zipped({"a": b"a"})[:cut]).startswith("expected a zip, got ")


def test_folders_count_as_entries() -> None:
    with open_archive(zipped({f"{number}/": b"" for number in range(900)})) as archive:
        assert archive.names == []
    many = zipped({f"{number}/": b"" for number in range(MAX_ENTRIES + 1)})
    assert refused(many) == "expected at most 4000 files and folders, got 4001"


def test_a_long_list_of_entries_is_not_read() -> None:
    names = {f"{number:0190}": b"" for number in range(9000)}
    assert refused(zipped(names)).startswith("expected a list of entries of at most 2,000,000 bytes, got 2,1")


def test_a_large_bundle_of_zeros_is_refused_by_its_ratio(monkeypatch: pytest.MonkeyPatch) -> None:
    """The size up to which any ratio is accepted is lowered, so that the test is quick."""
    zeros = zipped({"a": bytes(2_000_000)})
    with open_archive(zeros) as archive:
        archive.verify()
    monkeypatch.setattr(zip_archive, "SMALL_BYTES", 1_000_000)
    assert refused(zeros).startswith("expected at most 100 times the packed size beyond 1000000 bytes, got 1")


def test_an_entry_without_a_name_is_refused() -> None:
    data = bytearray(zipped({"a": b"a"}))
    entry = data.index(b"PK\x01\x02")
    data[entry + 28], data[entry + 30] = 0, 1  # the name becomes an extra field
    assert refused(bytes(data)) == "expected a name for every entry, got an entry without one"


def test_names_are_checked() -> None:
    assert refused(zipped({".povray/povray.conf": b""})).startswith("expected no hidden settings of POV-Ray")
    assert refused(zipped({"a/../b/": b""})).startswith("expected names inside the bundle")
