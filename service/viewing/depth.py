"""Depths of a frame on demand: the depth map of a view, and the depth to which to focus at a place.

The process that makes pictures imports this module, so it imports neither database nor broker.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.job.scenes.stage import Stage
from lippmann.lightfield.depth.plane_sweep import REACH
from lippmann.lightfield.depth.view_depth import estimated_depth
from lippmann.lightfield.refocus.autofocus import find_focus, sharpest_depth
from lippmann.lightfield.views.square_pixels import nearest_as_square
from lippmann.lightfield.views.views import view
from lippmann.plan.design.depths import shown_depths
from lippmann.plan.design.sharp_maps import focus_of_estimate, focus_of_point, focus_of_scene, view_of
from service.ports import Pictures
from service.schemas import viewing as schema
from service.viewing.render import Wanted, view_number
from service.viewing.sheet_cache import LocalPath, SheetCache
from service.viewing.viewable_frame import ViewableFrame

Map = NDArray[np.float32]


@dataclass(frozen=True)
class TrueDepth:
    """The true depth of a frame."""

    frame: ViewableFrame
    stage: Stage
    sheet_name: str
    """The name of the depth master."""
    etag: str
    """The entity tag of the depth master."""

    def scene_mm(self, number: tuple[int, int], sheets: SheetCache, local_path: LocalPath) -> Map:
        """Return the distances in the scene that a view shows, `(row, col)` of square pixels, mm."""
        layout = self.frame.layout
        sheet = sheets.scene_depth(self.sheet_name, self.etag, local_path)[..., np.newaxis]
        return nearest_as_square(view(sheet, layout, *number), layout)[..., 0]


@dataclass(frozen=True)
class TrueDepthMap:
    """The depths at which a view is sharp, from the true depth, as PFM."""

    depth: TrueDepth
    query: schema.DepthMapQuery

    @property
    def sheet_name(self) -> str:
        """The name of the depth master."""
        return self.depth.sheet_name

    def make(self, pictures: Pictures, sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Compute the map and encode it."""
        frame = self.depth.frame
        number = view_number(frame.layout, self.query.u, self.query.v)
        z_mm = self.depth.scene_mm(number, sheets, local_path)
        return pictures.pfm(focus_of_scene(view_of(frame.spec.rig, self.depth.stage, number), z_mm))


@dataclass(frozen=True)
class EstimatedDepthMap:
    """The depths at which a view is sharp, estimated from the pictures, as PFM."""

    frame: ViewableFrame
    query: schema.DepthMapQuery

    @property
    def sheet_name(self) -> str:
        """The name of the orthoscopic master."""
        return self.frame.sheet_name

    def make(self, pictures: Pictures, sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Estimate the map and encode it."""
        frame = self.frame
        number = view_number(frame.layout, self.query.u, self.query.v)
        found = estimated_depth(frame.image(sheets.sheet(frame, local_path)), number, reach=REACH).s_mm
        if frame.stage is not None:
            there = view_of(frame.spec.rig, frame.stage, number)
            found = focus_of_estimate(there, frame.stage, found, reach=REACH)
        return pictures.pfm(found)


@dataclass(frozen=True)
class TrueFocus:
    """The depth at a place, from the true depth, as the JSON of `FocusDepth`."""

    depth: TrueDepth
    query: schema.FocusQuery

    @property
    def sheet_name(self) -> str:
        """The name of the depth master."""
        return self.depth.sheet_name

    def make(self, _pictures: Pictures, sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Look up the surface, and trace its rays."""
        frame = self.depth.frame
        number = view_number(frame.layout, self.query.u, self.query.v)
        place = _place(frame, self.query)
        scene_mm = float(self.depth.scene_mm(number, sheets, local_path)[place])
        found = focus_of_point(view_of(frame.spec.rig, self.depth.stage, number), place, scene_mm)
        known_mm = None if found is None else scene_mm
        return _answer(schema.FocusDepth(depth_mm=found, source="truth", scene_mm=known_mm))


@dataclass(frozen=True)
class Autofocus:
    """The sharpest depth at a place, around a known depth or among all, as the JSON of `FocusDepth`."""

    frame: ViewableFrame
    query: schema.FocusQuery
    known: schema.FocusDepth | None

    @property
    def sheet_name(self) -> str:
        """The name of the orthoscopic master."""
        return self.frame.sheet_name

    def make(self, _pictures: Pictures, sheets: SheetCache, local_path: LocalPath) -> bytes:
        """Measure the sharpness."""
        frame, known = self.frame, self.known
        place, image = _place(frame, self.query), frame.image(sheets.sheet(frame, local_path))
        eye = _eye(frame, self.query)
        if known is not None and known.depth_mm is not None:
            sharp_mm = sharpest_depth(image, place, eye, known.depth_mm)
            return _answer(known.model_copy(update={"depth_mm": sharp_mm}))
        ends = shown_depths(frame.spec.rig, frame.stage)
        found_mm = find_focus(image, place, eye, (ends.from_mm, ends.to_mm))
        return _answer(schema.FocusDepth(depth_mm=found_mm, source="estimate", scene_mm=None))


def depth_map(frame: ViewableFrame, true_depth: TrueDepth | None, query: schema.DepthMapQuery) -> Wanted:
    """Return the depth map of a view."""
    return EstimatedDepthMap(frame, query) if true_depth is None else TrueDepthMap(true_depth, query)


def focus_depth(
    make: Callable[[Wanted], bytes], frame: ViewableFrame, true_depth: TrueDepth | None, query: schema.FocusQuery
) -> bytes:
    """Return the depth to which to focus at a place: the true one, and the sharpest one around it."""
    known = None
    if true_depth is not None:
        known = schema.FocusDepth.model_validate_json(make(TrueFocus(true_depth, query)))
    return make(Autofocus(frame, query, known))


def _place(frame: ViewableFrame, query: schema.FocusQuery) -> tuple[int, int]:
    """Return the (row, col) of a place in a view of square pixels."""
    rows, cols = frame.layout.square_size()
    return min(int(query.y * rows), rows - 1), min(int(query.x * cols), cols - 1)


def _eye(frame: ViewableFrame, query: schema.FocusQuery) -> tuple[float, float]:
    """Return the view in which the place is meant; by default the middle, where refocused pictures are seen from."""
    layout = frame.layout
    if query.u is None and query.v is None:
        return (layout.cell_cols - 1) / 2, (layout.cell_rows - 1) / 2
    u, v = view_number(layout, query.u, query.v)
    return float(u), float(v)


def _answer(found: schema.FocusDepth) -> bytes:
    return found.model_dump_json().encode()
