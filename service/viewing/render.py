"""Makes pictures of a frame: views, perspective, refocusing, observer, atlas, conversions.

The process that makes pictures imports this module, so it imports neither database nor broker.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import FieldProblem
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, observed_picture
from lippmann.lightfield.refocus.shift_and_sum import refocus
from lippmann.lightfield.views.atlas import atlas_picture, plan_atlas
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view
from lippmann.plan.design.observed_display import observed_display, used_gap_mm
from service.errors import Invalid
from service.ports import Pictures
from service.schemas import viewing as schema
from service.viewing.sheet_cache import LocalPath, Sheet, SheetCache
from service.viewing.viewable_frame import ViewableFrame

MAX_PICTURE_PX = 8192
"""The longest side of a picture that is enlarged on demand."""
MAX_EXR_PX = 4096
"""The same as EXR, which has 12 bytes a pixel."""

Light = NDArray[np.floating[Any]]


def render_view(sheet: Sheet, frame: ViewableFrame, query: schema.ViewQuery) -> Light:
    """Render a view on square pixels.

    Raises
    ------
    Invalid
        If the view does not exist. The error names u or v.
    """
    layout = frame.layout
    u, v = view_number(layout, query.u, query.v)
    return as_square(view(sheet, layout, u, v), layout)


def view_number(layout: CellLayout, u: int | None, v: int | None) -> tuple[int, int]:
    """Return the view (u, v) of a query, where None stands for the centre.

    Raises
    ------
    Invalid
        If the view is outside of the cell. The error names u or v.
    """
    middle_u, middle_v = centre(layout)
    u, v = middle_u if u is None else u, middle_v if v is None else v
    outside = [
        FieldProblem(field=field, expected=f"0 to {count - 1}", got=str(number))
        for field, number, count in (("u", u, layout.cell_cols), ("v", v, layout.cell_rows))
        if not 0 <= number < count
    ]
    if outside:
        raise Invalid("; ".join(map(str, outside)), problems=outside)
    return u, v


def render_perspective(sheet: Sheet, frame: ViewableFrame, query: schema.PerspectiveQuery) -> Light:
    """Render the perspective of an eye on square pixels; lenses that show the light of a neighbour are dark."""
    eye = _eye(frame, query)
    seen = perspective(frame.image(sheet), eye)
    return as_square(seen.picture, frame.layout)


def render_refocus(sheet: Sheet, frame: ViewableFrame, query: schema.RefocusQuery) -> Light:
    """Render the picture that is sharp at a depth."""
    return refocus(frame.image(sheet), query.depth_mm)


def render_observer(sheet: Sheet, frame: ViewableFrame, query: schema.ObserverQuery) -> Light:
    """Render what an observer sees of the display, by rays through pupil and lenses.

    Raises
    ------
    Invalid
        If two parameters exclude each other.
    LayoutError, OpticsError
        If the gap cannot be built, or the focus is not in front of the eye.
    """
    if query.gap is not None and query.gap_mm is not None:
        problem = FieldProblem(field="gap", expected="only one of gap and gap_mm", got="both")
        raise Invalid(str(problem), problems=[problem])
    spec = frame.spec
    gap_mm = used_gap_mm(spec.rig, spec.display, query.gap, stage=frame.stage) if query.gap else query.gap_mm
    display = observed_display(spec.rig, gap_mm=gap_mm)
    conditions = ViewingConditions(
        pupil_mm=query.pupil_mm,
        focus_mm=query.focus_mm,
        rays=query.rays,
        stereo=query.stereo,
        eye_distance_mm=query.eye_distance_mm,
    )
    window = whole_window(display, size_px=query.size)
    return observed_picture(sheet, display, _eye(frame, query), conditions, window=window)


def render_atlas(sheet: Sheet, frame: ViewableFrame, query: schema.AtlasQuery) -> Light:
    """Render all views as one picture."""
    return atlas_picture(frame.image(sheet), plan_atlas(frame.layout, max_px=query.max_px))


def _eye(frame: ViewableFrame, query: schema.PerspectiveQuery | schema.ObserverQuery) -> Eye:
    distance_mm = frame.spec.display.viewing_distance_mm if query.z is None else query.z
    if distance_mm <= 0:
        problem = FieldProblem(field="z", expected="an eye in front of the display, above 0", got=f"{distance_mm:g}")
        raise Invalid(str(problem), problems=[problem])
    return Eye(x_mm=query.x, y_mm=query.y, distance_mm=distance_mm)


Renderer = Callable[[Sheet, ViewableFrame, Any], Light]


class Wanted(Protocol):
    """The picture that a process is asked to make. Its fields are pickled: functions in them are those of a module."""

    @property
    def sheet_name(self) -> str:
        """The name of the artifact that it is made of."""

    def make(self, pictures: Pictures, sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Return a file."""


@dataclass(frozen=True)
class FramePicture:
    """A picture of a frame."""

    frame: ViewableFrame
    query: Any
    render: Renderer

    @property
    def sheet_name(self) -> str:
        """The name of the orthoscopic master."""
        return self.frame.sheet_name

    def make(self, pictures: Pictures, sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Render the picture and encode it as a file.

        Raises
        ------
        Invalid
            If the view or the place does not exist, or the picture would be too large.
        """
        query = self.query
        light = self.render(sheets.sheet(self.frame, local_path), self.frame, query)
        scale = query.scale if isinstance(query, schema.ScaledQuery) else 1
        longest = max(light.shape[:2]) * scale
        most = MAX_EXR_PX if query.format == "exr" else MAX_PICTURE_PX
        if scale > 1 and longest > most:
            expected = f"a picture of at most {most} px"
            problem = FieldProblem(field="scale", expected=expected, got=f"{longest} px")
            raise Invalid(str(problem), problems=[problem])
        options = {"filter_name": query.filter} if isinstance(query, schema.ScaledQuery) else {}
        return pictures.encode(light, as_format=query.format, scale=scale, **options)


@dataclass(frozen=True)
class Conversion:
    """A master as an sRGB PNG."""

    sheet_name: str
    """The name of the artifact, an EXR."""
    bits: int

    def make(self, pictures: Pictures, _sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Convert the master."""
        return pictures.png(local_path(), bits=self.bits)
