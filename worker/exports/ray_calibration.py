"""A calibration file in the manner of `RayCalibData`, the XML that light field cameras of Raytrix come with.

Its elements are read so by public tools (PlenopticToolbox 2.0 of Palmieri et al.; the lens grid of TUM's plenoptic
odometry; conversion tools for MPEG's lenslet sequences):

* `offset`: from the middle of the picture to the centre of the lens nearest it, px, x to the right and **y upward**;
* `diameter`: from lens to lens along a lens row, px; `rotation`: of the rows, radians, counter-clockwise;
* `lens_border`: px of a lens's rim that do not count;
* `tcp`: the total covering plane, the virtual depth (distance from the lenses by that of lenses and sensor) from which
  on lenses of one type see everything;
* `lens_base_x`, `lens_base_y`: the lattice, in diameters, y upward; `sub_grid_base`: its rectangular period;
* `lens_type`, one for each kind of lens: `offset` in the lattice, `depth_range` where it is sharp.

Our arrays have one type of lens, sharp at every depth, whose cells fill the plane: tcp 1, and a period of one lens. A
square lattice, and the element `lippmann`, are ours: no camera of theirs has such a lattice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from lippmann.lattice.layout import CellLayout

SHARP_TO = 1e6
"""The virtual depth up to which a pinhole is called sharp; it has no limit."""


@dataclass(frozen=True)
class LensGrid:
    """The lenses of a picture, in the conventions above."""

    offset_px: tuple[float, float]
    """The place (x, y) of the middle lens from the middle of the picture, y upward."""
    diameter_px: float
    row_base: tuple[float, float]
    """The vector from a lens to one in the next row above, in diameters."""
    period: tuple[float, float]


def lens_grid(layout: CellLayout, *, rows: int, cols: int) -> LensGrid:
    """Return where the lenses of a sheet lie in a picture that has it in its upper left corner.

    Parameters
    ----------
    layout
        The layout of the integral image.
    rows, cols
        The size of the picture, px.
    """
    lens_row, lens_col = layout.lens_rows // 2, layout.lens_cols // 2
    n, m = layout.px_per_lens, layout.row_px
    right = layout.shift_px(lens_row) + (lens_col + 0.5) * n
    down = layout.overhang_px + (lens_row + 0.5) * m
    cell = layout.cell
    return LensGrid(
        offset_px=(right - cols / 2, rows / 2 - down),
        diameter_px=float(n),
        row_base=(cell.row_shift, m / n),
        period=(1.0, cell.row_period * m / n),
    )


def calibration_xml(grid: LensGrid, *, ours: Mapping[str, object]) -> bytes:
    """Return the file: `RayCalibData`, with our own data in its last element, `lippmann`."""
    root = Element("RayCalibData", version="1.0")
    _pair(root, "offset", "pix", grid.offset_px)
    _value(root, "diameter", "pix", grid.diameter_px)
    _value(root, "rotation", "rad", 0.0)
    _value(root, "lens_border", "pix", 0.0)
    _value(root, "tcp", "virtual_depth", 1.0)
    _pair(root, "lens_base_x", "lens", (1.0, 0.0))
    _pair(root, "lens_base_y", "lens", grid.row_base)
    _pair(root, "sub_grid_base", "lens", grid.period)
    lens = SubElement(root, "lens_type", id="0")
    _pair(lens, "offset", "lens", (0.0, 0.0))
    _pair(lens, "depth_range", "virtual_depth", (1.0, SHARP_TO), names=("min", "max"))
    own = SubElement(root, "lippmann")
    for name, value in ours.items():
        SubElement(own, name).text = str(value)
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _value(parent: Element, name: str, units: str, value: float) -> None:
    SubElement(parent, name, units=units).text = f"{value:.12f}"


def _pair(
    parent: Element, name: str, units: str, values: tuple[float, float], *, names: tuple[str, str] = ("x", "y")
) -> None:
    pair = SubElement(parent, name, units=units)
    for axis, value in zip(names, values, strict=True):
        SubElement(pair, axis).text = f"{value:.12f}"
