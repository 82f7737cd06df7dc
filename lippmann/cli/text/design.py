"""A design as text, part by part, in the order in which light passes them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from lippmann.terminal.progress import duration_text
from lippmann.terminal.table import fields, table

if TYPE_CHECKING:
    from lippmann.plan.design.design import Design

Line = tuple[str, str | None]


def design_text(design: Design) -> str:
    """Return a design as text."""
    parts = [
        ("", _subject(design)),
        ("Imaging lens", _lens(design)),
        ("Image of the scene", _image(design)),
        ("Microlens array", _array(design)),
        ("Pixels and views", _pixels(design)),
        ("Display", _display(design)),
        ("Cost (estimates)", _cost(design)),
    ]
    width = max(len(name) for _, lines in parts for name, _ in lines)
    texts = [_part(head, [(name.ljust(width), text) for name, text in lines if text]) for head, lines in parts]
    texts.insert(3, _planes(design))
    return "\n\n".join(part for part in (*texts, *_warnings(design)) if part)


def _part(head: str, lines: list[tuple[str, str]]) -> str:
    text = fields(lines)
    return "\n".join(part for part in (head, text) if part) if text else ""


def _warnings(design: Design) -> Iterable[str]:
    if design.warnings:
        yield "\n".join(("Warnings", *(f"* {warning}" for warning in design.warnings)))


def _subject(one: Design) -> list[Line]:
    return [("job", one.title), ("scene", one.scene), ("frame", str(one.frame))]


def _lens(one: Design) -> list[Line]:
    if one.imaging_lens is None:
        return [("lens", "none: the array stands in the scene itself (direct pickup)")]
    return [
        ("lens", one.imaging_lens),
        ("focal length", _mm(one.efl_mm)),
        ("back focal distance", _mm(one.back_focal_distance_mm)),
        ("front focal distance", _mm(one.front_focal_distance_mm)),
        ("f-number", f"{one.f_number:.4g}; of the image's cone {_number(one.working_f_number)}"),
        ("length", _mm(one.lens_length_mm)),
    ]


def _image(one: Design) -> list[Line]:
    if one.imaging_lens is None:
        return []
    return [
        ("depth", f"{_mm(one.image_depth_mm)}; exact {_mm(one.exact_image_depth_mm)}"),
        ("depth compression", f"{_number(one.depth_compression)}; exact {_number(one.exact_depth_compression)}"),
        ("mean magnification", f"{_number(one.mean_magnification)}; exact {_number(one.exact_mean_magnification)}"),
    ]


def _planes(one: Design) -> str:
    spots = {
        "near": (one.spot_near_mm, one.spot_near_edge_mm),
        "reference": (one.spot_reference_mm, one.spot_reference_edge_mm),
        "far": (one.spot_far_mm, one.spot_far_edge_mm),
    }
    if one.conjugates is None:
        return ""
    rows = []
    for name, (axis_mm, edge_mm) in spots.items():
        plane = getattr(one.conjugates, name)
        image = (_number(plane.image_mm, 7), _number(plane.exact_image_mm, 7), _number(plane.magnification, 6))
        rows.append((name, f"{plane.object_mm:g}", *image, _number(axis_mm, 3), _number(edge_mm, 3)))
    head = ("plane", "object mm", "image mm", "exact", "magnification", "spot mm", "at the edge")
    crossings = [
        (f"{ray.object_mm:g}", f"{ray.height_mm:g}", _number(ray.image_mm, 9), _number(ray.aberration_mm, 4))
        for ray in one.axis_crossings
    ]
    rays = table(("object mm", "ray height mm", "crosses the axis at mm", "aberration mm"), crossings)
    return f"{table(head, rows)}\n\n{rays}"


def _array(one: Design) -> list[Line]:
    return [
        ("radius of a lens", _mm(one.lens_radius_mm)),
        ("displacement", _mm(one.displacement_mm)),
        ("thickness", _mm(one.lens_thickness_mm)),
        ("f-number", f"{one.mla_f_number:.4g}"),
        ("match", one.f_number_match),
        ("behind the lens", _mm(one.mla_behind_lens_mm) if one.mla_behind_lens_mm is not None else None),
        ("place", f"{one.mla_place}: {one.mla_place_words}"),
        ("s of near", f"{_mm(one.s_near_mm)}; exact {_mm(one.exact_s_near_mm)}"),
        ("s of reference", f"{_mm(one.s_reference_mm)}; exact {_mm(one.exact_s_reference_mm)}"),
        ("s of far", f"{_mm(one.s_far_mm)}; exact {_mm(one.exact_s_far_mm)}"),
        ("disparity near", f"{_number(one.disparity_near)} lenses a view; exact {_number(one.exact_disparity_near)}"),
        ("disparity far", f"{_number(one.disparity_far)} lenses a view; exact {_number(one.exact_disparity_far)}"),
    ]


def _pixels(one: Design) -> list[Line]:
    perspective = f"{one.camera_angle_deg:g} degrees, from {_mm(one.camera_distance_mm)}"
    return [
        ("integral image", f"{one.cols_px} x {one.rows_px} px"),
        ("lenses", f"{one.lens_cols} x {one.lens_rows}, {one.px_per_lens} px across each"),
        ("views", f"{one.views} of {one.view_cols_px} x {one.view_rows_px} px"),
        ("camera", "orthographic" if one.projection == "orthographic" else f"perspective, {perspective}"),
        ("as perspective", perspective if one.projection == "orthographic" else None),
        ("capture", one.capture_method.replace("_", " ")),
    ]


def _display(one: Design) -> list[Line]:
    cells = " and ".join(map(str, one.device_cells_px))
    back = "any depth" if one.resolvable_back_mm is None else _mm(one.resolvable_back_mm)
    return [
        ("pixel", f"{_mm(one.display_pixel_mm)}, {one.px_per_lens_device:.6g} a lens: cells of {cells}"),
        ("window", f"{one.device_cols_px} x {one.device_rows_px} px, margin {one.margin_px} px"),
        ("size", f"{one.width_mm:.5g} x {one.height_mm:.5g} mm"),
        ("gap, real", _gap(one.gap_real_mm, one.gap_real_physical_mm, one.central_depth_plane_real_mm)),
        ("gap, virtual", _gap(one.gap_virtual_mm, one.gap_virtual_physical_mm, one.central_depth_plane_virtual_mm)),
        ("gap, collimated", _gap(one.gap_collimated_mm, one.gap_collimated_physical_mm, None)),
        ("viewing angle", f"{one.viewing_angle_deg:.4g} degrees ({_angles(one)})"),
        ("viewing zone", f"{one.viewing_zone_mm:.4g} mm at {one.viewing_distance_mm:g} mm; "
                         f"{one.viewing_zone_whole_mm:.4g} mm for all lenses"),
        ("resolves", f"{_mm(one.resolvable_front_mm)} before it, {back} behind"),
        ("depth budget", f"{one.depth_budget}. {one.depth_budget_words}"),
    ]  # fmt: skip


def _angles(one: Design) -> str:
    return f"real {one.viewing_angle_real_deg:.4g}, virtual {one.viewing_angle_virtual_deg:.4g}"


def _cost(one: Design) -> list[Line]:
    return [
        ("a sheet", f"{one.sheet_mb:.3g} MB in half-floats"),
        ("memory of a slot", f"{one.memory_mb:.0f} MB"),
        ("CPU per frame", duration_text(one.frame_cpu_s)),
        ("CPU in all", f"{duration_text(one.cpu_s)} for {one.frames} frames" if one.frames > 1 else None),
        ("measured on", one.measured_on),
    ]


def _gap(reduced_mm: float, physical_mm: float, plane_mm: float | None) -> str:
    plane = "at infinity" if plane_mm is None else f"at {plane_mm:+.5g} mm"
    return f"{reduced_mm:.6g} mm reduced, {physical_mm:.5g} mm as built; sharpest {plane}"


def _mm(length: float | None) -> str:
    return "none" if length is None else f"{length:.7g} mm"


def _number(value: float | None, digits: int = 5) -> str:
    return "none" if value is None else f"{value:.{digits}g}"
