"""Drawings of the bench to scale, as SVG text: elements, planes and exact rays.

A drawing has two panels: the whole bench from the far plane to the camera, and an enlargement of the lens and the image
space. In each panel, lengths along and across the axis have the same scale. In direct pickup there is only the first
panel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from lippmann.job.scenes.stage import Stage
from lippmann.optics.drawing.bench import array, camera, glass, image_space, image_z, stop
from lippmann.optics.drawing.rays import Drawn, Path, fan, view_of_lens
from lippmann.optics.drawing.svg import LABEL_ROW_PX, LETTER_PX, Label, Panel, element, labels, placed_labels, scale_bar
from lippmann.optics.lens.matrices import conjugate
from lippmann.optics.lens.surfaces import ImagingLens
from lippmann.optics.rig.array import extent_mm
from lippmann.optics.rig.bench import Bench

WIDTH_PX = 1200.0
MARGIN_PX = 24.0
LEGEND_ROW_PX = 22.0
LABEL_ROWS = 3
"""The number of rows of labels that fit between a heading and its panel; with more rows the panel stands lower."""
MOST_PX = 420.0
"""The greatest height of a panel, px; a higher one is scaled down."""

STYLE = """
svg{font:12px system-ui,"Segoe UI","Liberation Sans","DejaVu Sans",sans-serif;
--paper:#fffffd;--ink:#1d2021;--soft:#5f6668;--line:#b9bdb9;--glass:#cfe3ea;--near:#0b6b72;--far:#b4570a;--edge:#7a3fa0;
--view:#a8261c;--space:#e9eecb}
@media (prefers-color-scheme:dark){svg{--paper:#131617;--ink:#e3e6e4;--soft:#99a2a3;--line:#4a5557;--glass:#274450;
--near:#6cc7cc;--far:#f0a35e;--edge:#c79be8;--view:#f2887c;--space:#3a4020}}
.paper{fill:var(--paper)}.label{fill:var(--ink)}.soft{fill:var(--soft)}.name{fill:var(--ink);font-size:15px;
font-weight:600}.head{fill:var(--soft);font-weight:600}.axis{stroke:var(--line);stroke-dasharray:14 4 2 4}
.leader{stroke:var(--line)}.plane{stroke:var(--soft);stroke-dasharray:5 4;fill:none}.glass{fill:var(--glass);
fill-opacity:.75;stroke:var(--ink)}.stop{stroke:var(--ink);stroke-width:3}.mla{stroke:var(--ink);stroke-width:2.5}
.lenses{stroke:var(--ink);fill:none}.space{fill:var(--space)}.camera{fill:none;stroke:var(--ink);stroke-width:1.5}
.bar{fill:none;stroke:var(--ink)}.ray{fill:none}.near{stroke:var(--near)}.far{stroke:var(--far)}
.edge{stroke:var(--edge)}.view{stroke:var(--view)}.beyond{fill:none;stroke-dasharray:2 3}
"""


@dataclass(frozen=True)
class _Fan:
    """The number of rays of one kind."""

    class_: str
    words: str
    rays: tuple[Drawn, ...]


def draw_bench(bench: Bench, stage: Stage, *, title: str = "") -> str:
    """Return a drawing of a bench and a scene's planes; the same text for the same numbers.

    Parameters
    ----------
    bench
        The bench of the rig.
    stage
        The stage of the scene.
    title
        The title of the drawing.
    """
    fans, views = _fans(bench, stage), view_of_lens(bench, object_mm=stage.far_mm)
    half_mm = _half_mm(bench, fans, views)
    body: list[str] = []
    bottom_px = _whole_panel(body, bench, stage, fans, views, half_mm)
    if bench.imaging_lens is not None:
        bottom_px = _lens_panel(body, bench, bench.imaging_lens, stage, fans, views, bottom_px)
    height_px = _legend(body, fans, has_views=bool(views), top_px=bottom_px)
    name = title or "The bench"
    head = [
        element("title", text=name),
        element("desc", text=_described(bench, stage)),
        element("style", text=STYLE.replace("\n", "")),
        element("rect", width=WIDTH_PX, height=height_px, class_="paper"),
        element("text", text=name, x=MARGIN_PX, y=30.0, class_="name"),
    ]
    return element(
        "svg",
        *(f"\n{part}" for part in (*head, *body)),
        "\n",
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH_PX:.0f} {height_px:.0f}",
        role="img",
    )


def _described(bench: Bench, stage: Stage) -> str:
    lens = bench.imaging_lens
    planes = f"The scene reaches from {stage.near_mm:g} to {stage.far_mm:g} mm before the origin"
    if lens is None:
        return f"{planes}; the microlens array stands in it, at z = {bench.mla_z_mm:.4g} mm. Direct pickup."
    return (
        f"{planes}, surface 1 of the imaging lens. The lens images it from "
        f"{bench.image_z_mm(stage.far_mm) - lens.length_mm:.4g} to "
        f"{bench.image_z_mm(stage.near_mm) - lens.length_mm:.4g} mm behind its last surface; the microlens array "
        f"stands {bench.mla_behind_lens_mm:.4g} mm behind it."
    )


def _fans(bench: Bench, stage: Stage) -> tuple[_Fan, ...]:
    near_z, far_z = image_z(bench, stage.near_mm), image_z(bench, stage.far_mm)
    near = fan(bench, object_mm=stage.near_mm, height_mm=0.0, image_mm=near_z)
    far = fan(bench, object_mm=stage.far_mm, height_mm=0.0, image_mm=far_z)
    edge = fan(bench, object_mm=stage.near_mm, height_mm=_edge_mm(bench, stage), image_mm=near_z)
    return (
        _Fan("near", "Point of the near plane on the axis", near),
        _Fan("far", "Point of the far plane on the axis", far),
        _Fan("edge", "Point of the near plane shown near the array's edge", edge),
    )


def _edge_mm(bench: Bench, stage: Stage) -> float:
    """Return the height of the near plane's point that is imaged below the array's upper edge, by a tenth of it."""
    image_mm = 0.45 * extent_mm(bench.rig.lens_array)[1]
    if bench.imaging_lens is None:
        return image_mm
    magnification = conjugate(bench.imaging_lens, stage.near_mm).magnification
    return image_mm / magnification if math.isfinite(magnification) else 0.0


def _half_mm(bench: Bench, fans: tuple[_Fan, ...], views: tuple[Path, ...]) -> float:
    rims = [surface.semi_aperture_mm for surface in bench.imaging_lens.surfaces] if bench.imaging_lens else []
    heights = [abs(height) for group in fans for ray in group.rays for _, height in ray.way]
    heights += [abs(height) for path in views for _, height in path]
    return 1.08 * max([extent_mm(bench.rig.lens_array)[1] / 2, *rims, *heights])


def _panel(*, top_px: float, from_mm: float, to_mm: float, half_mm: float) -> Panel:
    scale = min((WIDTH_PX - 2 * MARGIN_PX) / (to_mm - from_mm), MOST_PX / (2 * half_mm))
    left_px = (WIDTH_PX - scale * (to_mm - from_mm)) / 2
    return Panel(left_px, top_px + half_mm * scale, scale, from_mm, to_mm, half_mm)


def _whole_panel(
    body: list[str], bench: Bench, stage: Stage, fans: tuple[_Fan, ...], views: tuple[Path, ...], half_mm: float
) -> float:
    """Draw the bench from the far plane to the camera; return the lower end of the panel, px."""
    first_mm, last_mm = -stage.far_mm, max(bench.camera_z_mm, image_z(bench, stage.near_mm) or -math.inf)
    beside_mm = 0.02 * (last_mm - first_mm)
    panel = _panel(top_px=114, from_mm=first_mm - beside_mm, to_mm=last_mm + beside_mm, half_mm=half_mm)
    body.append(element("text", text="The whole bench", x=MARGIN_PX, y=54.0, class_="head"))
    marks = [(-stage.near_mm, f"near plane {stage.near_mm:g} mm"), (-stage.far_mm, f"far plane {stage.far_mm:g} mm")]
    if stage.reference_mm in (stage.near_mm, stage.far_mm):
        marks = [(z, f"reference and {words}" if z == -stage.reference_mm else words) for z, words in marks]
    else:
        marks.append((-stage.reference_mm, f"reference plane {stage.reference_mm:g} mm"))
    if bench.imaging_lens is not None:
        marks.append((0.0, "surface 1"))
    marks += [(bench.mla_z_mm, "array"), (bench.camera_z_mm, "camera")]
    panel, placed = _labelled(panel, marks)
    for z_mm in {-stage.near_mm, -stage.far_mm, -stage.reference_mm}:
        body.append(panel.line([(z_mm, half_mm), (z_mm, -half_mm)], "plane"))
    _draw(body, panel, bench, stage, fans, views, placed)
    return panel.bottom_px + 40


def _labelled(panel: Panel, marks: list[tuple[float, str]]) -> tuple[Panel, tuple[Label, ...]]:
    """Return a panel that leaves room for its labels, and the positions of the labels."""
    placed = placed_labels(panel, marks, width_px=WIDTH_PX)
    more = max(0, max(label.row for label in placed) + 1 - LABEL_ROWS)
    return replace(panel, axis_px=panel.axis_px + more * LABEL_ROW_PX), placed


def _lens_panel(
    body: list[str],
    bench: Bench,
    lens: ImagingLens,
    stage: Stage,
    fans: tuple[_Fan, ...],
    views: tuple[Path, ...],
    top_px: float,
) -> float:
    """Draw the lens and the image space; return the lower end of the panel, px."""
    near_z, far_z = image_z(bench, stage.near_mm), image_z(bench, stage.far_mm)
    ends = [z for z in (near_z, far_z) if z is not None and z < bench.mla_z_mm + 2 * lens.length_mm + 1e3]
    last_mm = max([bench.mla_z_mm, *ends])
    before_mm = min(
        0.0, lens.stop.z_mm if lens.stop else 0.0, lens.surfaces[0].sag_mm(lens.surfaces[0].semi_aperture_mm)
    )
    length_mm = last_mm - before_mm
    half_mm = 1.06 * max([extent_mm(bench.rig.lens_array)[1] / 2, *(one.semi_aperture_mm for one in lens.surfaces)])
    panel = _panel(
        top_px=top_px + 78, from_mm=before_mm - 0.1 * length_mm, to_mm=last_mm + 0.08 * length_mm, half_mm=half_mm
    )
    words = "Imaging lens and image space"
    body.append(element("text", text=words, x=MARGIN_PX, y=top_px + 18, class_="head"))
    end_mm = lens.length_mm
    marks = [(0.0, "surface 1"), (end_mm, f"surface {len(lens.surfaces)}")]
    marks.append((bench.mla_z_mm, f"array {bench.mla_behind_lens_mm:.5g} mm"))
    for z_mm, words in ((far_z, "image of far plane"), (near_z, "image of near plane")):
        if z_mm is not None and z_mm <= panel.to_mm:
            marks.append((z_mm, f"{words} {z_mm - end_mm:.5g} mm"))
    if lens.stop is not None:
        marks.append((lens.stop.z_mm, f"stop, diameter {2 * lens.stop.semi_aperture_mm:.4g} mm"))
    if bench.camera_z_mm <= panel.to_mm:
        marks.append((bench.camera_z_mm, "camera"))
    panel, placed = _labelled(panel, marks)
    _draw(body, panel, bench, stage, fans, views, placed)
    return panel.bottom_px + 40


def _draw(
    body: list[str],
    panel: Panel,
    bench: Bench,
    stage: Stage,
    fans: tuple[_Fan, ...],
    views: tuple[Path, ...],
    placed: tuple[Label, ...],
) -> None:
    """Draw the parts that both panels show, clipped to the panel."""
    clip = f"clip-{panel.axis_px:.0f}"
    width_px = (panel.to_mm - panel.from_mm) * panel.px_per_mm
    frame = element("rect", x=panel.left_px, y=panel.top_px, width=width_px, height=panel.bottom_px - panel.top_px)
    parts = [
        *image_space(panel, bench, stage),
        panel.line([(panel.from_mm, 0.0), (panel.to_mm, 0.0)], "axis"),
        *glass(panel, bench),
        *(panel.line(path, "ray view") for path in views),
        *_drawn_fans(panel, fans),
        *stop(panel, bench),
        *array(panel, bench),
        *camera(panel, bench),
    ]
    body.append(element("clipPath", frame, id=clip))
    body.append(element("g", *(f"\n{part}" for part in parts), clip_path=f"url(#{clip})"))
    body += [*labels(panel, placed), *scale_bar(panel)]


def _drawn_fans(panel: Panel, fans: tuple[_Fan, ...]) -> Iterator[str]:
    for group in fans:
        for ray in group.rays:
            yield panel.line(ray.way, f"ray {group.class_}")
            if ray.beyond[0] != ray.beyond[1]:
                yield panel.line(ray.beyond, f"beyond {group.class_}")


def _legend(body: list[str], fans: tuple[_Fan, ...], *, has_views: bool, top_px: float) -> float:
    """Draw the legend of the colours; return the height of the drawing, px."""
    entries = [(group.class_, group.words) for group in fans if group.rays]
    if has_views:
        entries.append(("view", "What the camera sees through one lens"))
    x_px, y_px = MARGIN_PX, top_px + LABEL_ROW_PX
    for class_, words in entries:
        length_px = 34 + LETTER_PX * len(words)
        if x_px + length_px > WIDTH_PX - MARGIN_PX:
            x_px, y_px = MARGIN_PX, y_px + LEGEND_ROW_PX
        body.append(element("path", d=f"M{x_px:.0f} {y_px - 4:.0f}h26", class_=f"ray {class_}", stroke_width=2.0))
        body.append(element("text", text=words, x=x_px + 34, y=y_px, class_="label"))
        x_px += length_px + 30
    note = "All rays are exact; of a point those are shown that the array takes. Dotted: where they would meet."
    body.append(element("text", text=note, x=MARGIN_PX, y=y_px + 24, class_="soft"))
    return y_px + 24 + MARGIN_PX
