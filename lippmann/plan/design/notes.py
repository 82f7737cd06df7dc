"""The notes of a design: matching f-numbers, the depth of the display, and warnings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec
from lippmann.optics.rig.bench import Bench
from lippmann.optics.rig.display import Resolvable


def f_number_match(optical_bench: Bench, working: float | None) -> str | None:
    """Return a note on whether the imaging lens fills the cells of the array with light; None without imaging lens."""
    if optical_bench.imaging_lens is None:
        return None
    array = optical_bench.rig.lens_array
    mla = array.focal_length_mm / array.pitch_mm
    if working is None:
        return "No ray of the reference plane's middle comes through the imaging lens."
    cones = f"The image's cone (f/{working:.3g}) is {{}} than the array's (f/{mla:.3g}): "
    if working <= mla:
        return cones.format("wider") + "cells are filled with light."
    return cones.format("narrower") + "the edges of cells stay dark."


def depth_budget(limit: Resolvable, *, near_mm: float, far_mm: float, distance_mm: float) -> dict[str, str]:
    """Return a note on whether a display resolves the whole image, from its depths s at near and far."""
    back_mm = -limit.back_mm
    span = f"The image reaches from s = {far_mm:+.1f} to {near_mm:+.1f} mm"
    can = f"seen from {distance_mm:g} mm the display resolves {_depth(back_mm)} to {limit.front_mm:+.1f} mm"
    fits = near_mm <= limit.front_mm and far_mm >= back_mm
    verdict = "all of it." if fits else f"{_excess(near_mm - limit.front_mm, back_mm - far_mm)} blur."
    return {"depth_budget": "fits" if fits else "exceeded", "depth_budget_words": f"{span}; {can}: {verdict}"}


def _depth(depth_mm: float) -> str:
    return "any depth behind it" if depth_mm == float("-inf") else f"{depth_mm:+.1f}"


def _excess(front_mm: float, back_mm: float) -> str:
    parts = [f"the {front_mm:.1f} mm nearest to the observer"] if front_mm > 0 else []
    parts += [f"the {back_mm:.1f} mm farthest behind"] if back_mm > 0 else []
    return " and ".join(parts)


def warnings(spec: JobSpec, stage: Stage, numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield warnings to check before rendering."""
    if numbers["depth_budget"] == "exceeded":
        yield numbers["depth_budget_words"]
    yield from _about_gaps(spec, numbers)
    yield from _about_pixels(spec, numbers)
    yield from _about_light(spec, stage, numbers)


def _about_gaps(spec: JobSpec, numbers: Mapping[str, Any]) -> Iterator[str]:
    array, display = spec.rig.lens_array, spec.display
    for name, gap_mm in (("real", display.gap_real_mm), ("virtual", display.gap_virtual_mm)):
        if gap_mm is not None and gap_mm < array.substrate_mm:
            yield (
                f"display.gap_{name}_mm of {gap_mm:g} mm is less than the array's substrate of "
                f"{array.substrate_mm:g} mm: the array would have to be ground down."
            )
    if numbers["gap_collimated_mm"] < array.substrate_mm / array.index:
        yield "The substrate alone is thicker than the collimated gap: real images cannot be focused on the pixels."
    plane_mm = numbers["central_depth_plane_real_mm"]
    if plane_mm < 0 and numbers["s_near_mm"] > 0:
        yield f"The real gap puts the central depth plane behind the display, at {plane_mm:+.1f} mm."


def _about_pixels(spec: JobSpec, numbers: Mapping[str, Any]) -> Iterator[str]:
    device_px = numbers["px_per_lens_device"]
    if spec.rig.device is not None and spec.rig.px_per_lens < device_px - 0.5:
        yield f"The device has {device_px:.4g} px a lens, and only {spec.rig.px_per_lens} are rendered."


def _about_light(spec: JobSpec, stage: Stage, numbers: Mapping[str, Any]) -> Iterator[str]:
    if spec.rig.imaging_lens is None:
        return
    for name in ("near", "reference", "far"):
        if numbers[f"exact_image_{name}_mm"] is None:
            yield f"No ray of the {name} plane's middle ({getattr(stage, f'{name}_mm'):g} mm) reaches the array."
        elif numbers[f"spot_{name}_edge_mm"] is None and spec.rig.lens_array.count[0] > 1:
            yield f"Points of the {name} plane at the edge of the array stay dark: the imaging lens vignettes them."
