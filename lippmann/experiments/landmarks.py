"""Points of the fish scene, and their positions in every view by the exact trace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OpticsError
from lippmann.job.scenes.stage import Stage
from lippmann.lightfield.views.views import centre
from lippmann.optics.rig.bench import Bench, object_rays, pixel_centres_mm
from lippmann.plan.sampling import display_size

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Landmark:
    """A point that can be recognised in a view, and the size of the object about it."""

    name: str
    place: tuple[float, float, float]
    """The position in scene units, as in povtemplates/scenes/fish/scene.inc."""
    half_height_mm: float
    """Half the height of the part that every view shows: nothing at another depth stands in front of it."""
    half_width_mm: float


LANDMARKS = (
    Landmark("fish", (0.0, 60.0, -18.0), 34.0, 45.0),
    Landmark("stem 1", (152.3, 128.9, 375.0), 34.0, 16.0),
    Landmark("stem 2", (-188.0, 195.9, 750.0), 42.0, 22.0),
    Landmark("stem 3", (139.7, 261.9, 1125.0), 50.0, 28.0),
    Landmark("stem 4", (-105.5, 327.9, 1500.0), 48.0, 34.0),
)
"""The flank of the fish, and the centre of the head of each bulrush, from the nearest to the farthest.

The back of the fish hides the lower end of the head of stem 4 in some views, and has more contrast than the head. The
patch of stem 4 ends above it, so that its depth is not taken for that of the fish.
"""


def rig_place_mm(place: tuple[float, float, float], stage: Stage) -> Array:
    """Return a point of the scene in the rig frame, (3,) mm; see docs/units-and-axes.md."""
    location, up = np.array(stage.location), np.array(stage.up)
    ahead = np.array(stage.look_at) - location
    ahead = ahead / np.linalg.norm(ahead)
    # POV-Ray's axes are left-handed, and so is its cross product.
    right = np.cross(up, ahead)
    right = right / np.linalg.norm(right)
    from_lens = (np.array(place) - location) * stage.mm_per_unit
    return np.array([from_lens @ right, from_lens @ np.cross(ahead, right), -from_lens @ ahead])


@dataclass(frozen=True)
class Traced:
    """The positions of a point in the views of one row, by the exact trace."""

    lens_row: Array
    """The lens row in each view, `(view,)`; fractions lie between lenses."""
    lens_col: Array

    @property
    def lenses_a_view(self) -> float:
        """The shift to the left, in lenses, as the eye moves right by one view."""
        return -float(np.polyfit(np.arange(len(self.lens_col)), self.lens_col, 1)[0])


def seen_places_mm(optical_bench: Bench, z_mm: float) -> Array:
    """Return the point of a plane that each pixel of the middle views sees, `(view, lens_row, lens_col, 2)`, mm.

    The lattice is square. The views are those of the orthoscopic integral image, in the order of
    `lippmann.lightfield.views.views`.
    """
    layout = display_size(optical_bench.rig)
    n, (_, v) = layout.px_per_lens, centre(layout)
    # The orthoscopic image has the lenses in reverse order and every cell as captured, so that the row of a view is one
    # row of the cells.
    rows = pixel_centres_mm(optical_bench)[n - 1 - v :: n]
    met = object_rays(optical_bench, rows).at_z(z_mm)[..., :2]
    cells = met.reshape(layout.lens_rows, layout.lens_cols, n, 2)[::-1, ::-1]
    places: Array = np.moveaxis(cells[:, :, ::-1], 2, 0)
    return places


def traced(optical_bench: Bench, place_mm: Array) -> Traced:
    """Return the positions of a point of the rig frame in the views of the middle row.

    Raises
    ------
    OpticsError
        If no ray of a view comes near the point.
    """
    places = seen_places_mm(optical_bench, float(place_mm[2]))
    found = np.array([_nearest(view, place_mm[:2]) for view in places])
    return Traced(lens_row=found[:, 0], lens_col=found[:, 1])


def _nearest(view: Array, wanted_mm: Array) -> tuple[float, float]:
    """Return the (lens_row, lens_col) that sees a point: the nearest lens, corrected by the slopes about it."""
    miss = ((view - wanted_mm) ** 2).sum(axis=-1)
    if not np.isfinite(miss).any():
        raise OpticsError(f"expected rays of a view toward {wanted_mm.round(1).tolist()} mm, got none")
    row, col = np.unravel_index(int(np.nanargmin(miss)), miss.shape)
    inner_row = int(np.clip(row, 1, view.shape[0] - 2))
    inner_col = int(np.clip(col, 1, view.shape[1] - 2))
    by_row = (view[inner_row + 1, inner_col] - view[inner_row - 1, inner_col]) / 2
    by_col = (view[inner_row, inner_col + 1] - view[inner_row, inner_col - 1]) / 2
    step = np.linalg.solve(np.stack((by_row, by_col), axis=1), wanted_mm - view[inner_row, inner_col])
    return inner_row + float(step[0]), inner_col + float(step[1])
