"""The parts of the bench as they are drawn in a panel: glass, stop, array, camera, image space."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from lippmann.job.scenes.stage import Stage
from lippmann.optics.drawing.svg import Panel, element
from lippmann.optics.lens.surfaces import Surface
from lippmann.optics.rig.array import extent_mm
from lippmann.optics.rig.bench import Bench
from lippmann.optics.rig.microlens import rim_radius_mm

SAG_STEPS = 24
LEAST_LENS_PX = 5.0
"""The least size of a lens that is drawn with its outline; an array of smaller lenses is drawn as a line."""
LENS_STEPS = 4


def image_z(bench: Bench, object_mm: float) -> float | None:
    """Return the z of the real image of a plane behind the lens; None if there is no such image.

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    """
    z_mm = bench.image_z_mm(object_mm)
    return z_mm if math.isfinite(z_mm) and z_mm > bench.lens_end_mm else None


def image_space(panel: Panel, bench: Bench, stage: Stage) -> Iterator[str]:
    """Yield the image space of the scene, as high as the array, and the images of its planes.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    bench
        The bench of the rig.
    stage
        The stage of the scene.
    """
    far_z, near_z = image_z(bench, stage.far_mm), image_z(bench, stage.near_mm)
    if bench.imaging_lens is None or far_z is None:
        return
    end_z = panel.to_mm if near_z is None else near_z
    half_mm = extent_mm(bench.rig.lens_array)[1] / 2
    yield element(
        "rect",
        x=panel.x(far_z),
        y=panel.y(half_mm),
        width=max(1.0, (end_z - far_z) * panel.px_per_mm),
        height=2 * half_mm * panel.px_per_mm,
        class_="space",
    )
    for z_mm in (far_z, near_z):
        if z_mm is not None:
            yield panel.line([(z_mm, half_mm), (z_mm, -half_mm)], "plane")


def glass(panel: Panel, bench: Bench) -> Iterator[str]:
    """Yield the outlines of the elements of the imaging lens.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    bench
        The bench of the rig.
    """
    lens = bench.imaging_lens
    if lens is None:
        return
    rows = list(zip(lens.surfaces, lens.vertices_mm, strict=True))
    for (front, front_z), (back, back_z) in pairwise(rows):
        if front.index_after != 1.0:
            outline = [*_profile(front, front_z), *reversed([*_profile(back, back_z)])]
            yield element("polygon", points=panel.points(outline), class_="glass")


def _profile(surface: Surface, vertex_mm: float) -> Iterator[tuple[float, float]]:
    for step in range(-SAG_STEPS, SAG_STEPS + 1):
        height_mm = surface.semi_aperture_mm * step / SAG_STEPS
        yield vertex_mm + surface.sag_mm(abs(height_mm)), height_mm


def stop(panel: Panel, bench: Bench) -> Iterator[str]:
    """Yield the two sides of the aperture stop as set.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    bench
        The bench of the rig.
    """
    lens = bench.imaging_lens
    if lens is None or lens.stop is None:
        return
    outer_mm = 1.05 * max(surface.semi_aperture_mm for surface in lens.surfaces)
    for side in (1, -1):
        hole = (lens.stop.z_mm, side * lens.stop.semi_aperture_mm)
        yield panel.line([hole, (lens.stop.z_mm, side * outer_mm)], "stop")


def array(panel: Panel, bench: Bench) -> Iterator[str]:
    """Yield the flat side of the array, and its lenses where they are large enough to be seen.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    bench
        The bench of the rig.
    """
    array = bench.rig.lens_array
    half_mm = extent_mm(array)[1] / 2
    yield panel.line([(bench.mla_z_mm, half_mm), (bench.mla_z_mm, -half_mm)], "mla")
    # The drawing is a section along a column of lenses; shifted rows have none.
    if array.pitch_mm * panel.px_per_mm < LEAST_LENS_PX or array.lenses_mm.cell.row_shift:
        return
    shape, rim_mm = bench.microlens, min(rim_radius_mm(array), array.pitch_mm / 2)
    for row in range(array.count[0]):
        middle_mm = ((array.count[0] - 1) / 2 - row) * array.pitch_mm
        across = [rim_mm * step / LENS_STEPS for step in range(-LENS_STEPS, LENS_STEPS + 1)]
        sphere_mm = bench.mla_z_mm - shape.displacement_mm
        arc = [(sphere_mm + math.sqrt(shape.radius_mm**2 - h**2), middle_mm + h) for h in across]
        yield panel.line(arc, "lenses")


def camera(panel: Panel, bench: Bench) -> Iterator[str]:
    """Yield the camera, and the window that it sees.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    bench
        The bench of the rig.
    """
    z_mm, half_mm = bench.camera_z_mm, bench.height_mm / 2
    if bench.rig.camera.projection == "perspective":
        yield panel.line([(bench.mla_z_mm, half_mm), (z_mm, 0.0), (bench.mla_z_mm, -half_mm)], "plane")
        yield element("circle", cx=panel.x(z_mm), cy=panel.y(0.0), r=3.5, class_="camera")
        return
    yield panel.line([(z_mm, half_mm), (z_mm, -half_mm)], "camera")
    for height_mm in (half_mm, -half_mm):
        yield panel.line([(z_mm, height_mm), (bench.mla_z_mm, height_mm)], "plane")
