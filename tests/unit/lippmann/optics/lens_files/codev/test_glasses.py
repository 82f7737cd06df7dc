"""Private glasses of CODE V files."""

from __future__ import annotations

import pytest

from lippmann.errors import SpecError
from lippmann.job.optics.glasses import Glass, glass
from lippmann.optics.lens_files.codev.commands import read_commands
from lippmann.optics.lens_files.codev.glasses import MAX_PRIVATE, PrivateGlasses
from lippmann.optics.lens_files.glasses.search import GlassSearch

N_BK7 = """\
PRV
PWL 706.5 656.3 632.8 546.1&
  486.1 435.8
'OWN' 1.51289 1.51432 1.51509 1.51872&
  1.52238 1.52668
END
"""
"""N-BK7 at six wavelengths of its data sheet."""


def glasses(text: str) -> PrivateGlasses:
    private = PrivateGlasses()
    assert all(private.take(command) for command in read_commands(text))
    private.check_end()
    return private


def found(text: str, name: str) -> tuple[Glass | None, list[str]]:
    search = GlassSearch()
    return glasses(text).find(name, search), search.notes


def test_indices_are_interpolated() -> None:
    own, notes = found(N_BK7, "own")
    known = glass("N-BK7")
    assert own is not None
    assert known is not None
    assert own.index == pytest.approx(known.index, abs=5e-5)
    assert own.abbe == pytest.approx(known.abbe, rel=5e-3)
    assert notes == []


@pytest.mark.parametrize("name", ["GLASS7", "CROWNGLASS", "A", "SO", "S1", "K", "PRVX", "517642", "ENDURO", "PWLA"])
@pytest.mark.parametrize("quote", ["'", '"', ""])
def test_a_name_is_kept_whole(name: str, quote: str) -> None:
    text = f"PRV\nPWL 587.6\n{quote}{name}{quote} 1.6\n{quote}{name}2{quote} 1.7\nEND"
    assert found(text, name)[0] == Glass(1.6, None)
    assert found(text, name.lower() + "2")[0] == Glass(1.7, None)
    assert found(text, name + "3")[0] is None


def test_a_glass_in_quotes_is_no_command() -> None:
    assert found("PRV\nPWL 587.6\n'END' 1.6\n'PWL' 1.7\nEND", "end")[0] == Glass(1.6, None)


def test_a_laurent_series_is_the_formula_of_schott() -> None:
    """N-BK7 by the Schott constants of its old data sheet (BK7: nd 1.51680, vd 64.17)."""
    terms = "2.2718929 -1.0108077E-2 1.0592509E-2 2.0816965E-4 -7.6472538E-6 4.9240991E-7"
    own, _ = found(f"PRV\nPWL 550\n'OLD' LAU {terms}\nEND", "OLD")
    assert own is not None
    assert own.index == pytest.approx(1.51680, abs=1e-5)
    assert own.abbe == pytest.approx(64.17, abs=0.01)


def test_every_glass_has_the_wavelengths_before_it() -> None:
    text = "PRV\nPWL 656.3 587.6 486.1\n'X' 1.6 1.61 1.62\nPWL 486.1 587.6 656.3\n'Y' 1.62 1.61 1.6\nEND"
    assert found(text, "X") == found(text, "Y")


@pytest.mark.parametrize(
    ("waves", "note"),
    [
        ("632.8", "line 3, G: the indices are given from 632.8 to 632.8 nm; the one at 632.8 nm is used at 587.6 nm"),
        ("550 450", "line 3, G: the indices are given from 450 to 550 nm; the one at 550 nm is used at 587.6 nm, wit"),
    ],
)
def test_indices_of_other_visible_light_are_used_and_said(waves: str, note: str) -> None:
    indices = " ".join(["1.6", "1.62"][: len(waves.split())])
    own, notes = found(f"PRV\nPWL {waves}\n'G' {indices}\nEND", "G")
    assert own == Glass(1.6, None)
    assert len(notes) == 1
    assert notes[0].startswith(note)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (N_BK7.replace(" 1.52668", ""), "line 4, OWN: expected 6 indices, one for each wavelength of PWL in nm, got 5"),
        ("PRV\n'OWN' 1.5\nEND", "line 2, OWN: expected PWL with the wavelengths in nm before the glass, got none"),
        ("PRV\nPWL 550\n'OWN' GMS 1 2 3\nEND", "line 3, OWN: expected an index for each wavelength of PWL, or LAU"),
        ("PRV\nPWL 550\n'OWN' LAU 1 x\nEND", "line 3, OWN: expected a number, got LAU 1 x"),
        ("PRV\nPWL 550\n'OWN' LAU -1\nEND", "line 3, OWN: expected an index from 1 to 4 at 587.6 nm, got none by"),
        (
            "PRV\nPWL 1600 900\n'OWN' 1.5 1.6\nEND",
            "line 3, OWN: expected a glass for visible light: its index is needed at 587.6 nm, got one from 900",
        ),
        ("PRV\nPWL 550\n'OWN' 1.5", "line 1, PRV: expected END behind the private glasses, got the end of the file"),
        (
            "PRV\n" + "".join(f"'G{number}' 1.5\n" for number in range(MAX_PRIVATE + 1)),
            f"line {MAX_PRIVATE + 2}, 'G{MAX_PRIVATE}': expected at most {MAX_PRIVATE} private glasses, got more",
        ),
    ],
)
def test_what_gives_no_index_is_refused(text: str, problem: str) -> None:
    with pytest.raises(SpecError) as caught:
        found(text, "OWN")
    assert problem in caught.value.message
