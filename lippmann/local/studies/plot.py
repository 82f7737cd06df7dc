"""Axes, points and lines: one plain style, on white, legible at 800 px."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lippmann.errors import LippmannError
from lippmann.terminal.extras import how_to_install

SIZE_IN = (8.0, 5.4)
DPI = 120
COLOURS = BLUE, ORANGE, GREEN, PURPLE = "#0b5fa5", "#c4500c", "#2c7a3f", "#6b4c9a"


def check_plots() -> None:
    """Check that matplotlib is installed.

    Raises
    ------
    LippmannError
        If it is not.
    """
    if find_spec("matplotlib") is None:
        raise LippmannError(f"expected matplotlib for plots, got none; {how_to_install('plots')}")


@contextmanager
def axes(*, title: str, x: str, y: str, note: str, files: tuple[Path, ...]) -> Iterator[Any]:
    """Yield labelled axes; when the block ends, the plot is written to every file, a .png or an .svg.

    Parameters
    ----------
    title, x, y
        The title, and the labels of the axes.
    note
        A small note below the axes, which names what was measured.
    files
        The files to write.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_IN, dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    drawn = figure.add_subplot()
    drawn.set_title(title, fontsize=13)
    drawn.set_xlabel(x, fontsize=12)
    drawn.set_ylabel(y, fontsize=12)
    drawn.tick_params(labelsize=11)
    drawn.grid(visible=True, color="#d8d8d8", linewidth=0.8)
    drawn.set_axisbelow(True)
    yield drawn
    drawn.legend(fontsize=11, frameon=True)
    figure.text(0.99, 0.012, note, ha="right", va="bottom", fontsize=9, color="#444444")
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    for file in files:
        figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)
