"""The headers, guards, constants and docs of the include files. tests/integration/povray has the tests with POV-Ray."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from lippmann.optics.lens import dispersion
from lippmann.optics.lens.surfaces import CONTACT_GAP_MM
from lippmann.optics.rig import method
from povtemplates.catalogue import INCLUDE_FOLDER
from tests.repository import DOCS, ROOT
from worker.engines.povray import scene
from worker.engines.povray.pictures import depth_codes

LIBRARY = INCLUDE_FOLDER / "lippmann"
INCLUDES = sorted(LIBRARY.glob("*.inc"))
PAGE = (DOCS / "sdl-library.md").read_text()

DEFINED = re.compile(r"(?:#macro|#declare) (Lippmann_\w+)")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def declared(name: str) -> float:
    """Return the number that the library declares under a name unless the user declares another."""
    text = "".join(include.read_text() for include in INCLUDES)
    (value,) = re.findall(rf"^#ifndef \({name}\) #declare {name} = ([\d.e-]+); #end$", text, re.MULTILINE)
    return float(value)


@pytest.mark.parametrize("include", INCLUDES, ids=lambda include: include.stem)
def test_an_include_has_a_header_and_a_guard(include: Path) -> None:
    """The header has the file's name, the project's version, the licence and an example of use."""
    text = include.read_text()
    guard = f"Lippmann_{include.stem.title()}_Inc"
    header, _, rest = text.partition(f"\n\n#ifndef ({guard})\n#declare {guard} = version;\n")
    assert rest, "the guard follows the header"
    assert header.startswith(f"// lippmann/{include.name} ")
    assert f"// Version:  Lippmann {VERSION}, for POV-Ray 3.7\n// Licence:  MIT\n" in header
    assert f'// Use:      #include "lippmann/{include.name}"\n' in header
    assert all(line.startswith("//") for line in header.splitlines() if line)
    assert rest.endswith(f"#if ({guard} < 3.7) #version {guard}; #end\n#end\n")


@pytest.mark.parametrize("include", INCLUDES, ids=lambda include: include.stem)
def test_an_include_itself_includes_every_file_whose_names_it_uses(include: Path) -> None:
    code = "".join(line.partition("//")[0] + "\n" for line in include.read_text().splitlines())
    included = {LIBRARY / name for name in re.findall(r'^#include "lippmann/(\w+\.inc)"$', code, re.MULTILINE)}
    owners = {name: one for one in INCLUDES for name in DEFINED.findall(one.read_text())}
    needed = {owners[name] for name in re.findall(r"\bLippmann_\w+", code)} - {include}
    assert needed <= included


def test_the_library_path_holds_nothing_but_the_library() -> None:
    """Its folders come before those of a bundle, and a folder of the same name in a bundle would not be found."""
    assert [path.name for path in INCLUDE_FOLDER.iterdir()] == ["lippmann"]


def test_the_optics_in_python_know_how_the_library_builds_glass() -> None:
    """`capture_method` decides by these numbers whether POV-Ray can resolve the gaps of a lens."""
    assert declared("Lippmann_Overlap") == method.OVERLAP_MM
    assert declared("Lippmann_Overlap_Fraction") == method.OVERLAP_FRACTION
    assert declared("Lippmann_Baffle_Gap") == CONTACT_GAP_MM
    assert declared("Lippmann_Baffle_Reach") == scene.BAFFLE_REACH
    assert declared("Lippmann_Baffle_Gap_Fraction") == method.BAFFLE_GAP_FRACTION


def test_dispersion_is_the_same_formula_in_both_languages() -> None:
    text = (LIBRARY / "glass.inc").read_text()
    lines = {dispersion.LINE_F_NM, dispersion.LINE_D_NM, dispersion.LINE_C_NM}
    assert {float(number) for number in re.findall(r"\b\d{3}\.\d{4}\b", text)} == lines
    assert set(re.findall(r"\) / (\d+)\b", text)) == {f"{dispersion.POVRAY_WIDTH_NM:g}"}


def test_the_mark_of_a_depth_pass_is_the_one_that_is_decoded() -> None:
    assert f"color rgb <0, 0, {depth_codes.MARK}> * Amplitude" in (LIBRARY / "depth.inc").read_text()


def test_every_macro_stands_in_the_docs_with_its_parameters_and_no_other() -> None:
    macros = [f"{name}({arguments})" for name, arguments in _in_library(r"^#macro (\w+)\(([^)]*)\)")]
    assert re.findall(r"^### `(\w+\([^`]*\))`$", PAGE, re.MULTILINE) == sorted(macros, key=_place_on_page)


def test_every_value_that_can_be_changed_stands_in_the_docs_with_its_default_and_no_other() -> None:
    values = {
        name: default.strip()
        for name, default in _in_library(r"#ifndef \((\w+)\)\s+#declare \1 = ([^;{]+)")
        if default != "version"
    }
    rows = dict(re.findall(r"^\| `(Lippmann_\w+)` \| (.*?) \|", PAGE, re.MULTILINE))
    assert {name: default.removeprefix("a ") for name, default in rows.items()} == values


def test_the_docs_name_nothing_that_is_not_in_the_library() -> None:
    library = {name for (name,) in _in_library(r"\b(Lippmann_\w+)")}
    assert set(re.findall(r"\bLippmann_\w+", PAGE)) <= library


def test_every_parameter_is_explained_in_the_section_of_its_file() -> None:
    for include in INCLUDES:
        section = PAGE.split(f"\n## lippmann/{include.name}\n")[1].split("\n## ")[0]
        rows = re.findall(r"^\| ([A-Z][\w, ]*) \|", section, re.MULTILINE)
        explained = {name.strip() for row in rows for name in row.split(",")}
        for name, arguments in re.findall(r"^#macro (\w+)\(([^)]*)\)", include.read_text(), re.MULTILINE):
            assert {one.strip() for one in arguments.split(",") if one} <= explained, name


def _in_library(pattern: str) -> list[tuple[str, ...]]:
    """Return the groups of every match in the text of the include files."""
    return [match.groups() for one in INCLUDES for match in re.finditer(pattern, one.read_text(), re.MULTILINE)]


def _place_on_page(macro: str) -> int:
    return PAGE.find(f"### `{macro}`")
