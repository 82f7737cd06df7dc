"""The label and the unit of a field, as a form shows them; both follow from the name of the field."""

from __future__ import annotations

UNITS = {
    "mm": "mm",
    "um": "µm",
    "px": "px",
    "deg": "°",
    "s": "s",
    "mb": "MB",
    "percent": "%",
}
"""The unit that each last word of a name stands for."""

_WORDS = {
    "px": "pixels",
    "mm": "millimetres",
    "cols": "columns",
    "s": "second",
    "dpi": "DPI",
    "crf": "CRF",
    "fps": "frames per second",
    "dtype": "number type",
}
"""The words of names that a form writes differently."""


def label_of(name: str) -> str:
    """Return the label of a field without its unit.

    >>> label_of("offset_mm")
    'Offset'
    >>> label_of("px_per_lens")
    'Pixels per lens'
    """
    words = name.split("_")
    if unit_of(name):
        words.pop()
    text = " ".join(_WORDS.get(word, word) for word in words)
    return text[:1].upper() + text[1:]


def unit_of(name: str) -> str:
    """Return the unit of a field; empty if its name has none.

    >>> unit_of("viewing_distance_mm")
    'mm'
    >>> unit_of("views_per_s")
    ''
    """
    *first, last = name.split("_")
    return UNITS.get(last, "") if first and first[-1] != "per" else ""
