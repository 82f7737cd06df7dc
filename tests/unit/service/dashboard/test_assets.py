"""Static files: what others wrote is what they wrote, and every module finds its imports."""

from __future__ import annotations

import hashlib
import json
import re
from urllib.parse import urljoin, urlsplit

import pytest

from service.dashboard.assets import FOLDER, PREFIX, SHEETS, VENDORED, assets, import_map
from tests.repository import ROOT

_LINES = (FOLDER / "vendor" / "HASHES").read_text().splitlines()
HASHES = {name: digest for digest, name in (line.split(maxsplit=1) for line in _LINES)}
MADE = {"page.js", "page.css"}
OURS = sorted(name for name in assets().keys() - MADE if not name.startswith("vendor/"))
MODULES = [name for name in OURS if name.endswith(".js")]

_IMPORT = re.compile(r'^import (?:[^;]*? from )?"([^"]+)";', re.MULTILINE)
_ADDRESS = re.compile(r"(?:https?:)?//[a-z0-9.-]+\.[a-z]{2,}", re.IGNORECASE)


def test_every_vendored_file_has_the_hash_that_was_written_down() -> None:
    files = {path.name: path for path in (FOLDER / "vendor").iterdir() if path.name not in {"HASHES", "README.md"}}
    assert {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()} == HASHES


def test_every_vendored_package_comes_with_its_licence() -> None:
    packages = {specifier.split("/")[0] for specifier in VENDORED}
    assert {f"LICENSE.{package}" for package in packages} <= set(HASHES)


def test_the_types_of_the_page_are_those_of_the_vendored_packages() -> None:
    table = (FOLDER / "vendor" / "README.md").read_text()
    vendored = dict(re.findall(r"^\| \S+ \| (\S+) \| (\S+) \|", table, re.MULTILINE))
    checked = json.loads((ROOT / "tests" / "page" / "package.json").read_text())["devDependencies"]
    packages = vendored.keys() & checked.keys()
    assert packages >= {"preact", "htm"}
    assert {name: checked[name] for name in packages} == {name: vendored[name] for name in packages}


@pytest.mark.parametrize("name", MODULES)
def test_every_import_leads_to_a_file(name: str) -> None:
    targets = import_map()["imports"]
    for specifier in _IMPORT.findall(assets()[name].body.decode()):
        if specifier.startswith("."):
            assert urljoin(name, specifier) in MODULES
            continue
        address = urlsplit(targets[specifier])
        asset = assets()[address.path.removeprefix(PREFIX)]
        assert address.query == f"v={asset.digest}"


def test_every_sheet_is_on_a_page() -> None:
    of_other_pages = {"account/login.css", "api/reference.css"}
    assert {name for name in OURS if name.endswith(".css")} == {*SHEETS, *of_other_pages}
    assert all(assets()[name].body in assets()["page.css"].body for name in SHEETS)


def test_every_module_is_reached_from_a_page() -> None:
    reached, open_names = set(), ["app.js", "account/login.js"]
    while open_names:
        name = open_names.pop()
        if name not in reached:
            reached.add(name)
            imports = _IMPORT.findall(assets()[name].body.decode())
            open_names += [urljoin(name, specifier) for specifier in imports if specifier.startswith(".")]
    assert reached == set(MODULES)


@pytest.mark.parametrize("name", OURS)
def test_no_file_of_ours_asks_for_anything_elsewhere(name: str) -> None:
    text = assets()[name].body.decode().replace("http://www.w3.org/2000/svg", "")
    assert _ADDRESS.findall(text) == []


@pytest.mark.parametrize("name", OURS)
def test_no_file_of_ours_is_too_long_to_read(name: str) -> None:
    lines = assets()[name].body.decode().splitlines()
    assert len(lines) <= 250
    assert max(map(len, lines)) <= 120
