"""The wavelength bands of a dispersing rig: the bench at each wavelength, and its share in each colour channel.

A picture in colour is the sum of one picture a band, each through the lens as it refracts that wavelength.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lippmann.optics.lens.dispersion import LINE_D_NM, POVRAY_WIDTH_NM, povray_dispersion, povray_index
from lippmann.optics.lens.surfaces import ImagingLens
from lippmann.optics.rig.bench import Bench
from lippmann.optics.rig.colour_matching import srgb_weights

SHORTEST_NM = 380.0
LONGEST_NM = SHORTEST_NM + POVRAY_WIDTH_NM
"""The limits of the spectrum, which are those of POV-Ray."""


@dataclass(frozen=True)
class WavelengthBand:
    """A band of the spectrum."""

    wavelength_nm: float
    """The wavelength of its rays."""
    bench: Bench
    """The bench with the indices of its glasses at that wavelength."""
    weights: tuple[float, float, float]
    """The share of the band in red, green and blue of linear sRGB; those of all bands sum to 1."""


def wavelength_bands(bench: Bench, count: int) -> tuple[WavelengthBand, ...]:
    """Return the wavelength bands of a bench; one that leaves all colours as they are if nothing disperses.

    The bands are equally wide and their wavelengths are their middles, as POV-Ray splits a ray in glass.

    Parameters
    ----------
    bench
        The bench of the rig, whose indices are those at the d line.
    count
        The number of bands into which a dispersing rig splits the spectrum.
    """
    lens = bench.imaging_lens
    if not bench.rig.dispersion or lens is None or not _disperses(lens):
        return (WavelengthBand(LINE_D_NM, bench, (1.0, 1.0, 1.0)),)
    edges_nm = np.linspace(SHORTEST_NM, LONGEST_NM, count + 1)
    middles_nm = (edges_nm[:-1] + edges_nm[1:]) / 2
    return tuple(
        WavelengthBand(nm, replace(bench, imaging_lens=lens_at(lens, nm)), (red, green, blue))
        for nm, (red, green, blue) in zip(middles_nm.tolist(), srgb_weights(edges_nm).tolist(), strict=True)
    )


def lens_at(lens: ImagingLens, wavelength_nm: float) -> ImagingLens:
    """Return a lens with the indices of its glasses at a wavelength, by the dispersion that POV-Ray gives them.

    Parameters
    ----------
    lens
        The lens, whose indices are those at the d line.
    wavelength_nm
        The wavelength, nm.
    """
    surfaces = []
    for surface in lens.surfaces:
        spread = povray_dispersion(surface.index_after, surface.abbe_after)
        index = surface.index_after if spread == 1.0 else povray_index(surface.index_after, spread, wavelength_nm)
        surfaces.append(replace(surface, index_after=index))
    return replace(lens, surfaces=tuple(surfaces))


def _disperses(lens: ImagingLens) -> bool:
    return any(povray_dispersion(surface.index_after, surface.abbe_after) != 1.0 for surface in lens.surfaces)
