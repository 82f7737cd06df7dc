"""The display that an observer looks at, from a rig: its pixels and its gap."""

from __future__ import annotations

from lippmann.errors import LayoutError
from lippmann.job.optics.rig import LensArray, Rig
from lippmann.job.optics.viewing import Bare, GapUse, Surround
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import Display
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.optics.rig.display import reduced_gap_mm
from lippmann.plan.design.designer import bench_as_written
from lippmann.plan.design.gaps import Gap, contact_gap_mm, gaps
from lippmann.plan.sampling import display_size


def observed_display(
    rig: Rig,
    *,
    gap_mm: float | None = None,
    on_device: bool = False,
    bare: Bare = "clear",
    surround: Surround = "black",
) -> LensDisplay:
    """Return a display with the lenses of a rig.

    Parameters
    ----------
    rig
        The rig, whose array has the places and the shape of the lenses.
    gap_mm
        The reduced gap; the default is one focal length.
    on_device
        True if the pixels are those of the rig's device, not one cell of the rendered ones a lens.
    bare, surround
        See `LensDisplay`.

    Raises
    ------
    LayoutError
        If the gap cannot be built, or there is no device.
    """
    array = rig.lens_array
    if on_device and rig.device is None:
        raise LayoutError("expected a rig with a device, whose pixels are to be seen, got rig.device null")
    gap_mm = array.focal_length_mm if gap_mm is None else gap_mm
    _check_buildable(array, gap_mm)
    return LensDisplay(
        layout=display_size(rig),
        pitch_mm=array.pitch_mm,
        focal_mm=array.focal_length_mm,
        gap_mm=gap_mm,
        device_px_mm=rig.device.pixel_mm if on_device and rig.device else None,
        aperture=array.aperture,
        bare=bare,
        surround=surround,
    )


def reduced_mm(array: LensArray, physical_mm: float) -> float:
    """Return the reduced gap for a gap as built, which includes the substrate.

    Raises
    ------
    LayoutError
        If it is smaller than the substrate.
    """
    if not physical_mm >= array.substrate_mm:
        raise LayoutError(
            f"expected a physical gap of at least the substrate's {array.substrate_mm:g} mm, got {physical_mm:g} mm"
        )
    return reduced_gap_mm(physical_mm, substrate_mm=array.substrate_mm, index=array.index)


def used_gap_mm(rig: Rig, shown: Display, use: GapUse, *, stage: Stage | None) -> float:
    """Return the reduced gap for a use, as `lippmann design` chooses it.

    Parameters
    ----------
    stage
        The stage of the scene, whose depths the gap serves; None if it is unknown.

    Raises
    ------
    LayoutError
        If the job names no such gap and nobody knows the scene's depths.
    OpticsError, SpecError
        If the rig cannot be built.
    """
    if stage is not None:
        optical_bench = bench_as_written(rig, stage)
        found = gaps(
            rig.lens_array, shown, near_mm=optical_bench.s_mm(stage.near_mm), far_mm=optical_bench.s_mm(stage.far_mm)
        )
        return found[use].reduced_mm
    given_mm = {"real": shown.gap_real_mm, "virtual": shown.gap_virtual_mm, "collimated": None}[use]
    if use != "collimated" and given_mm is None:
        raise LayoutError(f"expected display.gap_{use}_mm, as no scene says which depths to serve, got none")
    return rig.lens_array.focal_length_mm if given_mm is None else reduced_mm(rig.lens_array, given_mm)


def gap_in_use(rig: Rig, shown: Display, *, stage: Stage | None) -> tuple[GapUse, Gap]:
    """Return the gap to build a display with: for real images if the reference plane is in front, else for virtual.

    Parameters
    ----------
    stage
        The stage of the scene; None if it is unknown. Then a gap that the job names is used, or one focal length.

    Raises
    ------
    OpticsError, SpecError
        If the rig cannot be built.
    """
    array = rig.lens_array
    near_mm = far_mm = 0.0
    use: GapUse = "collimated"
    if stage is not None:
        optical_bench = bench_as_written(rig, stage)
        near_mm, far_mm = optical_bench.s_mm(stage.near_mm), optical_bench.s_mm(stage.far_mm)
        use = "real" if optical_bench.s_mm(stage.reference_mm) >= 0 else "virtual"
    elif shown.gap_real_mm is not None:
        use = "real"
    elif shown.gap_virtual_mm is not None:
        use = "virtual"
    return use, gaps(array, shown, near_mm=near_mm, far_mm=far_mm)[use]


def _check_buildable(array: LensArray, gap_mm: float) -> None:
    contact_mm = contact_gap_mm(array)
    if 0 < gap_mm < contact_mm * (1 - 1e-9):
        raise LayoutError(
            f"expected a reduced gap of at least {contact_mm:.4g} mm, that of the substrate in contact with the pixels"
            f" ({array.substrate_mm:g} mm of index {array.index:g}), got {gap_mm:g} mm"
        )
