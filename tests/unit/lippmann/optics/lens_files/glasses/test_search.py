"""Glasses of lens files whose names several makers use."""

from __future__ import annotations

import pytest

from lippmann.optics.lens_files.glasses.search import GlassSearch


def notes(name: str, *makers: str) -> list[str]:
    search = GlassSearch(makers=makers)
    assert search.find(name) is not None
    return search.notes


@pytest.mark.parametrize(
    ("name", "index"),
    [("F1", 1.62588), ("F3", 1.61293), ("F4", 1.61659), ("F6", 1.63636), ("F7", 1.62536), ("LAFN21", 1.78831)],
)
def test_old_glasses_of_schott_are_not_those_of_other_makers(name: str, index: float) -> None:
    """The codes of the glasses are 626357, 613370, 617366, 636353, 625356 and 788475; CDGM has other ones."""
    found = GlassSearch().find(name)
    assert found is not None
    assert found.index == index


@pytest.mark.parametrize(
    ("name", "makers"),
    [
        ("BK7", ()),
        ("BK7", ("SCHOTT",)),
        ("N-BK7", ("OHARA",)),
        ("S-LAL8", ("SCHOTT",)),
        ("SLAL8_OHARA", ("SCHOTT",)),
        ("TAF3", ("SCHOTT", "HOYA")),
        ("TAF3_HOYA", ()),
        ("PMMA", ("SCHOTT",)),
        ("517642", ("SCHOTT",)),
        ("BK7", ("MYGLASS",)),
    ],
)
def test_a_glass_of_a_maker_that_is_said_or_usual_needs_no_note(name: str, makers: tuple[str, ...]) -> None:
    assert notes(name, *makers) == []


@pytest.mark.parametrize(
    ("name", "makers", "note"),
    [
        (
            "LAFN2",
            ("SUMITA",),
            "the glass LAFN2 is read as N-LAF2 of Schott, index 1.74397, because the file's SUMITA l",
        ),
        (
            "TAF3",
            ("SCHOTT", "OHARA", "X"),
            "the glass TAF3 is read as TAF3 of Hoya, index 1.8042, because the file's SC",
        ),
        ("TAF3", (), "the glass TAF3 is read as TAF3 of Hoya, index 1.8042"),
        ("hk9l", (), "the glass hk9l is read as H-K9L of CDGM, index 1.5168"),
    ],
)
def test_a_glass_of_another_maker_is_said(name: str, makers: tuple[str, ...], note: str) -> None:
    """The LaFN2 of Sumita has an index of 1.697."""
    (found,) = notes(name, *makers)
    assert found.startswith(note)
