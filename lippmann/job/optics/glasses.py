"""Optical materials: the refractive index and the Abbe number of glasses and plastics, by name.

`index` is nd, at the helium line of 587.6 nm; `abbe` is Vd = (nd - 1) / (nF - nC), with nF at 486.1 nm and nC at
656.3 nm. The table and its sources are in optical_glasses.txt.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, lru_cache
from pathlib import Path
from types import MappingProxyType

MAX_NAME = 40
"""The greatest length of a name that is looked up."""
SCHOTT = "SCHOTT"

_OTHER_NAMES = MappingProxyType(
    {
        "PMMA": "ACRYLIC",
        "PLEXIGLAS": "ACRYLIC",
        "SILICA": "FUSED-SILICA",
        "F_SILICA": "FUSED-SILICA",
        "SIO2": "FUSED-SILICA",
        "C79-80": "FUSED-SILICA",
        "POLYCARB": "POLYCARBONATE",
        "POLYSTYR": "POLYSTYRENE",
    }
)


_OTHER_MAKERS = MappingProxyType({"SPECIAL": "MISC"})
"""The names of CODE V for makers that the table names otherwise."""


@dataclass(frozen=True)
class Glass:
    """The refractive index and the Abbe number of a material."""

    index: float
    abbe: float | None
    """The Abbe number; None for a material without dispersion."""


@dataclass(frozen=True)
class NamedGlass:
    """A glass of the table, with its name there."""

    maker: str
    name: str
    glass: Glass
    is_named_maker: bool
    """True if the name that was asked for, or the caller, selects the maker."""


def glass(name: str, makers: Sequence[str] = ()) -> Glass | None:
    """Return the material of a name, in upper or lower case, with or without hyphens; None for an unknown name.

    Schott's glass counts if several makers use a name. An old name of Schott without an entry (`SK16`, `SSKN5`)
    selects the lead-free successor (`N-SK16`, `N-SSK5`), which has nearly the same nd and Vd. `NAME_MAKER`
    selects the maker.

    Parameters
    ----------
    name
        The name.
    makers
        The makers whose glasses count first, in their order.

    Examples
    --------
    >>> glass("bk7")
    Glass(index=1.5168, abbe=64.17)
    >>> glass("H-K9L"), glass("NBK7_SCHOTT") == glass("N-BK7"), glass("F2_CDGM")
    (Glass(index=1.5168, abbe=64.2), True, Glass(index=1.61293, abbe=36.99))
    >>> print(glass("unobtainium"))
    None
    """
    found = find_glass(name, makers)
    return None if found is None else found.glass


def find_glass(name: str, makers: Sequence[str] = ()) -> NamedGlass | None:
    """Return the entry of a material in the table; None for an unknown name.

    Parameters
    ----------
    name
        The name, as for `glass`.
    makers
        The makers whose glasses count first, in their order.

    Examples
    --------
    >>> find_glass("SK16")
    NamedGlass(maker='SCHOTT', name='N-SK16', glass=Glass(index=1.62041, abbe=60.32), is_named_maker=False)
    """
    key = glass_key(name)
    if len(key) > MAX_NAME:
        return None
    table = glasses_by_maker()
    order = [maker for maker in dict.fromkeys((*makers, SCHOTT, *table)) if maker in table]
    before, separator, suffix = name.strip().upper().rpartition("_")
    maker = _OTHER_MAKERS.get(suffix, suffix)
    found = _found(key, order, makers)
    if found is None and separator and maker in table:
        found = _found(glass_key(before), [maker], [maker])
    return found


def known_names() -> Iterator[str]:
    """Yield the names of all glasses, maker by maker."""
    for names in glasses_by_maker().values():
        yield from names


def expected_glass(name: str) -> str:
    """Return what a message expects instead of an unknown name, with the names that are most like it."""
    like = _names_like(name[:MAX_NAME].upper())
    hint = f" (did you mean {', '.join(like)}?)" if like else ""
    makers = ", ".join(maker if maker == "CDGM" else maker.title() for maker in glasses_by_maker() if maker != "MISC")
    return f"a glass of {makers} by its name{hint}"


def glass_key(name: str) -> str:
    """Return a name as names are compared: in capital letters, without hyphens, spaces and underscores."""
    return name.strip().upper().replace("-", "").replace(" ", "").replace("_", "")


@cache
def glasses_by_maker() -> Mapping[str, Mapping[str, Glass]]:
    """Return all glasses by maker and name."""
    table: dict[str, dict[str, Glass]] = {}
    names: dict[str, Glass] = {}
    for line in Path(__file__).with_name("optical_glasses.txt").read_text("utf-8").splitlines():
        if line.startswith("["):
            names = table.setdefault(line.strip("[]"), {})
        elif not line.startswith("#"):
            name, index, abbe = line.split()
            names[name] = Glass(float(index), float(abbe))
    return MappingProxyType(table)


def _found(key: str, order: Sequence[str], named: Sequence[str]) -> NamedGlass | None:
    for maker in order:
        names = _names_by_key()[maker]
        name = names.get(key)
        if name is None and maker == SCHOTT:
            name = names.get(f"N{key}") or names.get(_without_last_n(key))
        if name is not None:
            return NamedGlass(maker, name, glasses_by_maker()[maker][name], maker in named)
    return None


def _without_last_n(key: str) -> str:
    """Return the name of today for one such as SSKN5: NSSK5."""
    letters = key.rstrip("0123456789")
    return f"N{letters[:-1]}{key[len(letters) :]}" if letters.endswith("N") and letters != key else ""


@cache
def _names_by_key() -> Mapping[str, Mapping[str, str]]:
    keys = {maker: {glass_key(name): name for name in names} for maker, names in glasses_by_maker().items()}
    keys["MISC"].update({glass_key(other): name for other, name in _OTHER_NAMES.items()})
    return MappingProxyType(keys)


@lru_cache(maxsize=256)
def _names_like(name: str) -> list[str]:
    return get_close_matches(name, list(dict.fromkeys(known_names())), n=3, cutoff=0.75)
