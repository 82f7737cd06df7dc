"""Optical materials: the refractive index and the Abbe number of common glasses and plastics.

`index` is nd, at the helium line of 587.6 nm; `abbe` is Vd = (nd - 1) / (nF - nC), with nF at 486.1 nm and nC at
656.3 nm. The glasses are from Schott's optical glass data sheets (the collection of 2014 and later, which still lists
the leaded glasses without `N-`). Acrylic, polycarbonate and polystyrene are from the `MISC` catalogue of Zemax.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Glass:
    """The refractive index and the Abbe number of a material."""

    index: float
    abbe: float


GLASSES = MappingProxyType(
    {
        "N-FK5": Glass(1.48749, 70.41),
        "N-FK51A": Glass(1.48656, 84.47),
        "N-PK51": Glass(1.52855, 76.98),
        "N-PK52A": Glass(1.49700, 81.61),
        "N-PSK3": Glass(1.55232, 63.46),
        "N-BK7": Glass(1.51680, 64.17),
        "N-K5": Glass(1.52249, 59.48),
        "K7": Glass(1.51112, 60.41),
        "K10": Glass(1.50137, 56.41),
        "N-BAK1": Glass(1.57250, 57.55),
        "N-BAK2": Glass(1.53996, 59.71),
        "N-BAK4": Glass(1.56883, 55.98),
        "N-SK2": Glass(1.60738, 56.65),
        "N-SK4": Glass(1.61272, 58.63),
        "N-SK5": Glass(1.58913, 61.27),
        "N-SK11": Glass(1.56384, 60.80),
        "N-SK14": Glass(1.60311, 60.60),
        "N-SK16": Glass(1.62041, 60.32),
        "N-SSK5": Glass(1.65844, 50.88),
        "N-SSK8": Glass(1.61773, 49.83),
        "N-BAF10": Glass(1.67003, 47.11),
        "N-LAK8": Glass(1.71300, 53.83),
        "N-LAK9": Glass(1.69100, 54.71),
        "N-LAK10": Glass(1.72003, 50.62),
        "N-LAK14": Glass(1.69680, 55.41),
        "N-LAK21": Glass(1.64049, 60.10),
        "N-LAK22": Glass(1.65113, 55.89),
        "N-LAK34": Glass(1.72916, 54.50),
        "N-LASF9": Glass(1.85025, 32.17),
        "N-LASF44": Glass(1.80420, 46.50),
        "LLF1": Glass(1.54814, 45.75),
        "LF5": Glass(1.58144, 40.85),
        "F2": Glass(1.62004, 36.37),
        "N-F2": Glass(1.62005, 36.43),
        "F5": Glass(1.60342, 38.03),
        "SF1": Glass(1.71736, 29.51),
        "N-SF1": Glass(1.71736, 29.62),
        "SF2": Glass(1.64769, 33.85),
        "N-SF2": Glass(1.64769, 33.82),
        "SF5": Glass(1.67270, 32.21),
        "N-SF5": Glass(1.67271, 32.25),
        "SF6": Glass(1.80518, 25.43),
        "N-SF6": Glass(1.80518, 25.36),
        "SF10": Glass(1.72825, 28.41),
        "N-SF10": Glass(1.72828, 28.53),
        "SF11": Glass(1.78472, 25.76),
        "N-SF11": Glass(1.78472, 25.68),
        "SF57": Glass(1.84666, 23.83),
        "N-SF57": Glass(1.84666, 23.78),
        "FUSED-SILICA": Glass(1.45846, 67.82),
        "ACRYLIC": Glass(1.49176, 57.44),
        "POLYCARBONATE": Glass(1.58547, 29.91),
        "POLYSTYRENE": Glass(1.59048, 30.87),
    }
)
"""The materials by their catalogue names."""

_OTHER_NAMES = MappingProxyType(
    {
        "PMMA": "ACRYLIC",
        "PLEXIGLAS": "ACRYLIC",
        "SILICA": "FUSED-SILICA",
        "F_SILICA": "FUSED-SILICA",
        "POLYCARB": "POLYCARBONATE",
        "POLYSTYR": "POLYSTYRENE",
    }
)


def glass(name: str) -> Glass | None:
    """Return the material of a name, in upper or lower case; None for an unknown name.

    An old name without an entry (`SK16`) selects the lead-free successor (`N-SK16`), which has the same nd, and a Vd
    within 0.3.

    >>> glass("bk7")
    Glass(index=1.5168, abbe=64.17)
    >>> print(glass("unobtainium"))
    None
    """
    key = name.strip().upper().replace(" ", "-")
    key = _OTHER_NAMES.get(key, key)
    return GLASSES.get(key) or GLASSES.get(f"N-{key}")
