"""The private glasses of a CODE V sequence file: the lines between PRV and END.

A glass has an index for every wavelength of PWL, or the coefficients of a Laurent series (LAU), which is the formula of
Schott: n^2 = A0 + A1 w + A2 / w + A3 / w^2 + A4 / w^3 + A5 / w^4, w the square of the wavelength in micrometres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.glasses import Glass
from lippmann.optics.lens.dispersion import LINE_C_NM, LINE_D_NM, LINE_F_NM
from lippmann.optics.lens_files.codev.commands import Command
from lippmann.optics.lens_files.glasses.agf import CatalogueGlass
from lippmann.optics.lens_files.glasses.search import FOR_VISIBLE_LIGHT, GlassSearch
from lippmann.optics.lens_files.lines import QUOTES
from lippmann.optics.lens_files.system import VISIBLE_UM

MAX_PRIVATE = 200
NEAR_NM = 1.0
"""The greatest distance of a spectral line from a table, whose wavelengths are rounded, nm."""
LAURENT = "LAU"
SCHOTT_FORMULA = 1


@dataclass(frozen=True)
class _Entry:
    command: Command
    waves: Command | None


class PrivateGlasses:
    """Takes the lines between PRV and END, and returns the glasses by their names."""

    def __init__(self) -> None:
        self._start: Command | None = None
        self._waves: Command | None = None
        self._entries: dict[str, _Entry] = {}

    def take(self, command: Command) -> bool:
        """Take a command, and return whether it belongs to the private glasses."""
        if self._start is None:
            self._start = command if command.word == "PRV" else None
            return self._start is not None
        # A glass may be named ENDURO or, in quotes, END.
        whole = command.name if command.word.isalpha() else ""
        if whole == "END":
            self._start = None
        elif whole == "PWL":
            self._waves = command
        elif len(self._entries) < MAX_PRIVATE:
            named = Command(command.number, command.name, command.values)
            self._entries[command.name] = _Entry(named, self._waves)
        else:
            command.refuse(f"at most {MAX_PRIVATE} private glasses", "more")
        return True

    def check_end(self) -> None:
        """Check that the private glasses end.

        Raises
        ------
        SpecError
            If the last PRV has no END.
        """
        if self._start is not None:
            self._start.refuse("END behind the private glasses", "the end of the file")

    def find(self, name: str, glasses: GlassSearch) -> Glass | None:
        """Return the private glass of a name, None for another name.

        Parameters
        ----------
        name
            The name, in upper or lower case.
        glasses
            The search that takes the notes.

        Raises
        ------
        SpecError
            If the glass has no index at 587.6 nm and none for other visible light.
        """
        entry = self._entries.get(name.strip(QUOTES).upper())
        if entry is None:
            return None
        command = entry.command
        if command.values[:1] and command.values[0].upper() == LAURENT:
            terms = tuple(command.value(place) for place in range(1, len(command.values)))
            return CatalogueGlass(command.place, formula=SCHOTT_FORMULA, coefficients=terms).glass()
        waves_nm, indices = _table(entry)
        return _interpolated(command, waves_nm, indices, glasses)


def _table(entry: _Entry) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the wavelengths of a glass, falling, nm, and its indices."""
    command = entry.command
    if entry.waves is None:
        command.refuse("PWL with the wavelengths in nm before the glass", "none")
    if command.values[:1] and command.values[0].isalpha():
        command.refuse("an index for each wavelength of PWL, or LAU and its coefficients", command.values[0][:40])
    waves_nm, indices = np.array(entry.waves.all_numbers()), np.array(command.all_numbers())
    if len(waves_nm) != len(indices) or len(waves_nm) < 1 or (waves_nm <= 1).any():
        command.refuse(f"{len(waves_nm)} indices, one for each wavelength of PWL in nm", f"{len(indices)}")
    order = np.argsort(waves_nm)[::-1]
    return waves_nm[order], indices[order]


def _interpolated(
    command: Command, waves_nm: NDArray[np.float64], indices: NDArray[np.float64], glasses: GlassSearch
) -> Glass:
    """Return a glass, interpolated over the inverse square of the wavelength."""
    blue, yellow, red = (
        float(np.interp(line_nm**-2.0, waves_nm**-2.0, indices)) for line_nm in (LINE_F_NM, LINE_D_NM, LINE_C_NM)
    )
    least_nm, most_nm = float(waves_nm.min()), float(waves_nm.max())
    if not least_nm - NEAR_NM <= LINE_D_NM <= most_nm + NEAR_NM:
        nearest_nm = min(max(LINE_D_NM, least_nm), most_nm)
        if not VISIBLE_UM[0] <= nearest_nm / 1000 <= VISIBLE_UM[1]:
            command.refuse(FOR_VISIBLE_LIGHT, f"one from {least_nm:g} to {most_nm:g} nm")
        glasses.note(
            f"{command.place}: the indices are given from {least_nm:g} to {most_nm:g} nm; the one at {nearest_nm:g} nm "
            "is used at 587.6 nm, without an Abbe number"
        )
    reaches = least_nm <= LINE_F_NM + NEAR_NM and most_nm >= LINE_C_NM - NEAR_NM
    abbe = (yellow - 1) / (blue - red) if blue > red and reaches else 0.0
    return Glass(index=round(yellow, 6), abbe=round(abbe, 4) if 1.0 <= abbe <= 1000.0 else None)
