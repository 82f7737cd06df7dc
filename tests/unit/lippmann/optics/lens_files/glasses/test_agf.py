"""Glass catalogues in the AGF format."""

from __future__ import annotations

import math

import pytest

from lippmann.errors import InvalidText, SpecError
from lippmann.job.optics.glasses import Glass, glass
from lippmann.optics.lens_files.glasses.agf import MAX_GLASSES, read_agf
from lippmann.optics.lens_files.glasses.search import GlassSearch, coded_glass
from lippmann.untrusted.text_lines import MAX_LINES

CROWN = """\
CC a catalogue of our own
NM N-BK7 2 517642 1.5168 64.17 0 1
GC some words
ED 7.1 8.3 2.51 -0.0009 0
CD 1.03961212E+00 6.00069867E-03 2.31792344E-01 2.00179144E-02 1.01046945E+00 1.03560653E+02 0 0 0 0
TD 1.86E-06 1.31E-08 -1.37E-11 4.34E-07 6.27E-10 0.17 20
LD 0.3 2.5
IT 0.3 0.05 25
"""
FLINT = (
    "nm flint-7 2.0E+00 0 1.62004 36.37\ncd 1.34533359 0.00997743871 0.209073176 0.0470450767 0.937357162 111.886764\n"
)
INFRARED = "NM GLOW 2 0 4.0 0\nCD 15 0.1\nLD 2 14\n"


def found(text: str, name: str) -> Glass | None:
    return GlassSearch([read_agf(text, title="own.agf")]).find(name)


def test_a_glass_has_the_numbers_of_its_formula() -> None:
    for text, name in ((CROWN, "N-BK7"), (FLINT, "F2")):
        own = found(text, "flint-7" if text is FLINT else name)
        table = glass(name)
        assert own is not None
        assert table is not None
        assert own.index == pytest.approx(table.index, abs=6e-6)
        assert own.abbe == pytest.approx(table.abbe, abs=6e-3)


@pytest.mark.parametrize("name", ["N-BK7", "n-bk7", "NBK7", "NBK7_OWN"])
def test_a_glass_is_found_by_the_names_of_design_programs(name: str) -> None:
    own = found(CROWN.replace("1.0396", "1.0496"), name)
    assert own is not None
    assert own.index > 1.518


def test_what_a_catalogue_lacks_comes_from_the_table() -> None:
    assert found(CROWN, "SF6") == glass("SF6")
    assert found(CROWN, "unobtainium") is None


def test_the_first_catalogue_that_has_a_glass_counts() -> None:
    one, two = (read_agf(f"NM G 5 0\nCD {index}") for index in (1.6, 1.7))
    assert GlassSearch([one, two]).find("G") == Glass(1.6, None)


def test_the_temperature_is_ignored_and_said_once() -> None:
    search = GlassSearch([read_agf(CROWN + FLINT, title="own.agf")])
    search.find("FLINT-7")
    assert search.notes == []
    search.find("N-BK7")
    search.find("N-BK7")
    assert search.notes == ["own.agf: the temperature data is ignored; a glass is at the catalogue's temperature"]


def test_a_formula_that_contradicts_the_index_beside_the_name_is_said() -> None:
    search = GlassSearch([read_agf(FLINT.replace("1.62004", "1.7"), title="own.agf")])
    search.find("FLINT-7")
    assert search.notes == [
        "own.agf, line 1, NM FLINT-7: the index by its formula, 1.62004, is used, and not the 1.7 beside its name"
    ]


@pytest.mark.parametrize(
    ("text", "name", "problem"),
    [
        (INFRARED, "GLOW", "own.agf, line 1, NM GLOW: expected a glass for visible light"),
        ("NM G 14 0 1.5\nCD 1.5", "G", "own.agf, line 1, NM G: expected a dispersion formula of 1 (Schott), 2 (Sell"),
        ("NM G -1 0 1.5\nCD 1.5", "G", "13 (Extended 3), got -1"),
        ("NM G 1 0 1.5\nCD -1", "G", "expected an index from 1 to 4 at 587.6 nm, got none by the formula Schott"),
        ("NM G 1 0 1.5\nCD 100", "G", "expected an index from 1 to 4 at 587.6 nm, got 10 by the formula Schott"),
        ("NM G 1 0 1.5", "G", "got 0 by the formula Schott"),
        ("NM G", "G", "own.agf, line 1, NM: expected a name and the number of a dispersion formula, got 'G'"),
        ("NM G two", "G", "own.agf, line 1, NM G: expected a finite number, got 'two'"),
        ("NM G 1\nCD 2.2 1,5", "G", "own.agf, line 2, CD of G: expected a finite number, got '1,5'"),
        ("NM G 1\nLD nan 2\nCD x", "G", "own.agf, line 2, LD of G: expected a finite number, got 'nan'"),
    ],
)
def test_a_glass_that_cannot_be_used_is_refused_when_it_is(text: str, name: str, problem: str) -> None:
    text += "\n" + FLINT
    assert found(text, "FLINT-7") is not None
    with pytest.raises(SpecError) as caught:
        found(text, name)
    assert problem in caught.value.message


def test_glasses_with_a_line_that_cannot_be_read_are_named() -> None:
    text = "NM G 1\nCD x\n" + CROWN + "NM\n" + "".join(f"NM BAD{number} 1\nLD 1 x\n" for number in range(8))
    search = GlassSearch([read_agf(text, title="own.agf"), read_agf(FLINT, title="other.agf")])
    assert search.notes == [
        "own.agf: a glass that has a line that cannot be read is left out: line 1, NM G, line 11, NM, line 12, NM BAD0,"
        " line 14, NM BAD1, line 16, NM BAD2, line 18, NM BAD3, line 20, NM BAD4, line 22, NM BAD5 and 2 more"
    ]
    assert search.find("N-BK7") == found(CROWN, "N-BK7")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", r"^\(whole\): expected a catalogue with NM lines, got no NM line$"),
        ("CD 1 2 3", "no NM line"),
        ("NM G", "line 1, NM: expected a name and the number of a dispersion formula, got 'G'"),
        ("NM G two", "line 1, NM G: expected a finite number, got 'two'"),
        ("NM G 1.5", "line 1, NM G: expected the number of a dispersion formula, got '1.5'"),
        ("NM G nan", "line 1, NM G: expected a finite number"),
        ("NM G 1 0 inf", "line 1, NM G: expected a finite number"),
        ("NM G 1\nCD 1 x", "line 2, CD of G: expected a finite number, got 'x'"),
        ("NM G 1\nLD 1 nan", "line 2, LD of G: expected a finite number"),
        ("NM G two\nNM H 1\nCD x", "line 1, NM G: expected a finite number, got 'two'"),
    ],
)
def test_a_file_that_is_no_catalogue_is_refused(text: str, problem: str) -> None:
    with pytest.raises(SpecError, match=problem):
        read_agf(text)


def test_a_catalogue_has_limits() -> None:
    with pytest.raises(InvalidText, match="at most 20,000 lines"):
        read_agf("\n" * (MAX_LINES + 1))
    with pytest.raises(SpecError, match="expected at most 5,000 glasses"):
        read_agf("".join(f"NM G{number} 1\n" for number in range(MAX_GLASSES + 1)))


@pytest.mark.parametrize(
    ("code", "index", "abbe"),
    [("517642", 1.517, 64.2), ("620.364", 1.62, 36.4), ("517000.520000", 1.517, 52.0), ("500.700", 1.5, 70.0)],
)
def test_a_code_is_a_glass(code: str, index: float, abbe: float) -> None:
    made = coded_glass(code)
    assert made is not None
    assert made.index == pytest.approx(index)
    assert made.abbe == pytest.approx(abbe)


@pytest.mark.parametrize("code", ["51764", "000642", "517000", "5176421", "517.", "abc642"])
def test_other_numbers_are_no_codes(code: str) -> None:
    assert coded_glass(code) is None


def test_a_glass_without_the_lines_of_the_abbe_number_has_none() -> None:
    made = read_agf("NM G 5 0\nCD 1.5 0.01\nLD 0.55 0.7").glasses["G"].glass()
    assert made.abbe is None
    assert math.isclose(made.index, 1.5 + 0.01 / 0.5875618)
