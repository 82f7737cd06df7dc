"""Comparisons as text and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.quality.compare import Spread, spread
from lippmann.local.studies.compare import Comparison
from lippmann.terminal.table import table

NUMBERS = ("psnr_y_db", "psnr_rgb_db", "ssim")
_HEADS = ("psnr y", "psnr rgb", "ssim")


def compared_data(compared: Sequence[Comparison]) -> dict[str, Any]:
    """Return everything for programs: null is an infinite PSNR, or an SSIM or a view that is not there."""
    return {
        "frames": [_frame_data(one) for one in compared],
        "mean": {
            "sheet": {name: _number(_mean([getattr(one.sheet, name) for one in compared])) for name in NUMBERS},
            "views": {name: _number(_mean([_over(one, name).mean for one in compared])) for name in NUMBERS},
        },
    }


def compared_text(compared: Sequence[Comparison]) -> str:
    """Return one comparison in full, or one line a frame."""
    text = _one_text(compared[0]) if len(compared) == 1 else _frames_text(compared)
    lenses = dict.fromkeys(one.layout for one in compared)
    return "\n".join([*(f"{layout}, {int(layout.mask.sum())} views" for layout in lenses), "", text])


def _frame_data(one: Comparison) -> dict[str, Any]:
    layout = one.layout
    return {
        "name": one.pair.name,
        "a": str(one.pair.first),
        "b": str(one.pair.second),
        "lenses": {
            "count": [layout.lens_rows, layout.lens_cols],
            "px_per_lens": layout.px_per_lens,
            "lattice": layout.lattice,
        },
        "sheet": {name: _number(getattr(one.sheet, name)) for name in NUMBERS},
        "view_exists": layout.mask.tolist(),
        "views": {name: _views_data(getattr(one.views, name)) for name in NUMBERS},
    }


def _views_data(values: NDArray[np.float64]) -> dict[str, Any]:
    over = spread(values)
    return {
        "mean": _number(over.mean),
        "minimum": _number(over.minimum),
        "deviation": _number(over.deviation),
        "worst": None if over.worst is None else {"u": over.worst[0], "v": over.worst[1]},
        "infinite": over.infinite,
        "each": [[_number(value) for value in row] for row in values.tolist()],
    }


def _one_text(one: Comparison) -> str:
    over = [_over(one, name) for name in NUMBERS]
    rows = [
        ("whole sheet", *_cells([getattr(one.sheet, name) for name in NUMBERS])),
        ("views, mean", *_cells([each.mean for each in over])),
        ("views, standard deviation", *_cells([each.deviation for each in over])),
        ("worst view", *_cells([each.minimum for each in over])),
        ("  its (u, v)", *(each.worst for each in over)),
    ]
    return "\n".join([table(("", *_HEADS), rows), *_alike_note(one)])


def _frames_text(compared: Sequence[Comparison]) -> str:
    rows = [(one.pair.name, *_cells(_line(one)), _worst_text(_over(one, "psnr_y_db"))) for one in compared]
    means = [_mean(column) for column in zip(*(_line(one) for one in compared), strict=True)]
    views = tuple(f"views {head}" for head in _HEADS)
    text = table(("frame", *_HEADS, *views, "worst view"), [*rows, ("mean", *_cells(means), "")])
    return "\n".join([text, *(f"{one.pair.name}: {note}" for one in compared for note in _alike_note(one))])


def _line(one: Comparison) -> list[float]:
    return [*(getattr(one.sheet, name) for name in NUMBERS), *(_over(one, name).mean for name in NUMBERS)]


def _alike_note(one: Comparison) -> list[str]:
    alike = _over(one, "psnr_rgb_db").infinite
    return [f"identical views: {alike}; mean and deviation of the PSNR leave them out"] if alike else []


def _worst_text(over: Spread) -> str:
    return "-" if over.worst is None else f"{over.worst} {over.minimum:.2f} dB"


def _over(one: Comparison, name: str) -> Spread:
    return spread(getattr(one.views, name))


def _mean(values: Sequence[float]) -> float:
    """Return the mean over frames, as `spread` takes it over views: without the identical ones."""
    return spread(np.array([values])).mean


def _cells(numbers: Sequence[float]) -> list[str]:
    units = (" dB", " dB", "") * (len(numbers) // len(NUMBERS))
    return [_cell(number, unit) for number, unit in zip(numbers, units, strict=True)]


def _cell(number: float, unit: str) -> str:
    if math.isnan(number):
        return "-"
    if math.isinf(number):
        return "infinite"
    return f"{number:.2f}{unit}" if unit else f"{number:.4f}"


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
