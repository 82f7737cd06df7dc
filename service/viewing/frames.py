"""Looking into a frame: its orthoscopic sheet, kept in memory while people look, and what can be seen of it."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel
from sqlalchemy.orm import Session

from lippmann.errors import ArtifactMissing, FieldProblem
from lippmann.job.resolved import JobSheet
from lippmann.job.spec import JobSpec
from lippmann.job.stage import Stage
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.observer.looking import Looking, look
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.refocus.shift_and_sum import refocus
from lippmann.lightfield.views.atlas import atlas_picture, plan_atlas
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view, view_numbers
from lippmann.plan import artifact_names as names
from lippmann.plan.design.depths import shown_depths
from lippmann.plan.design.lens import ended
from lippmann.plan.design.observed_display import observed_display, used_gap_mm
from lippmann.plan.sampling import display_size
from service.api import presenters as show
from service.errors import Invalid, NotFound
from service.health import package_version
from service.jobs.state_machine import find_job
from service.ports import Parts
from service.schemas import look as schema

MAX_SHOWN_PX = 8192
"""The longest side of a picture that is made on demand."""

MAX_LOOKED_PX = 2**27
"""Of an integral image that is looked into: 0.8 GB, and up to six times as much beside it while it is refocused."""

Sheet = NDArray[np.float16]
Light = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Sight:
    """A frame that can be looked into."""

    frame: int
    spec: JobSpec
    """At this frame."""
    stage: Stage | None
    """Likewise; none of sheets from elsewhere."""
    sheet_name: str
    """Of its orthoscopic master, in the store."""
    etag: str
    """Of that, without quotes."""

    @property
    def layout(self) -> CellLayout:
        """Of the orthoscopic sheet."""
        return display_size(self.spec.rig)

    @property
    def gap_mm(self) -> float:
        """From the pixels to the lenses: everything here is seen as under an array one focal length off."""
        return self.spec.rig.lens_array.focal_length_mm

    def image(self, pixels: Sheet) -> IntegralImage:
        """Return the integral image of the frame, from the pixels of its orthoscopic master."""
        pitch_mm = self.spec.rig.lens_array.pitch_mm
        return IntegralImage(pixels=pixels, layout=self.layout, pitch_mm=pitch_mm, focal_length_mm=self.gap_mm)


class Sheets:
    """Sheets that were looked into last, decoded; as many as there is room for, for any number of threads."""

    def __init__(self, parts: Parts, *, room_bytes: int) -> None:
        self._parts, self._room_bytes = parts, room_bytes
        self._kept: OrderedDict[tuple[str, str], Sheet] = OrderedDict()
        self._lock = threading.Lock()
        self._decoding = threading.Lock()

    def sheet(self, sight: Sight) -> Sheet:
        """Return a sheet `(rows, cols, 3)`, linear light, not to be written to.

        Raises
        ------
        ArtifactMissing, ArtifactBroken
            If it is gone meanwhile, or not whole.
        """
        key = (sight.sheet_name, sight.etag)
        known = self._known(key)
        if known is not None:
            return known
        # One at a time: who drags a slider asks for the same sheet several times before it is there.
        with self._decoding:
            known = self._known(key)
            if known is not None:
                return known
            with self._parts.store.local_path(sight.sheet_name) as path:
                sheet = self._parts.pictures.light(path)
            self._keep(key, sheet)
        return sheet

    def _known(self, key: tuple[str, str]) -> Sheet | None:
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def _keep(self, key: tuple[str, str], sheet: Sheet) -> None:
        with self._lock:
            self._kept[key] = sheet
            while len(self._kept) > 1 and sum(each.nbytes for each in self._kept.values()) > self._room_bytes:
                self._kept.popitem(last=False)


def find_sight(session: Session, parts: Parts, job_id: str, frame: int) -> Sight:
    """Return a frame that can be looked into.

    Raises
    ------
    NotFound
        If there is no such job, or it has no such frame.
    ArtifactMissing
        If the frame is not assembled yet.
    Invalid
        If its integral image is too large to be kept in memory.
    """
    spec = show.spec_of(find_job(session, job_id))
    if frame not in spec.frame_numbers:
        raise NotFound(f"job {job_id!r} has the frames {spec.frames}, not {frame}")
    layout = display_size(spec.rig)
    if layout.rows * layout.cols > MAX_LOOKED_PX:
        expected = f"an integral image of at most {MAX_LOOKED_PX} px to look into: larger ones are for outputs"
        problem = FieldProblem(field="frame", expected=expected, got=f"{layout.rows} x {layout.cols} px")
        raise Invalid(str(problem), problems=[problem])
    name = names.job_artifact(job_id, names.orthoscopic_name(frame))
    try:
        etag = parts.store.etag(name)
    except ArtifactMissing as error:
        raise ArtifactMissing(f"frame {frame} of job {job_id!r} is not assembled yet") from error
    sheet = JobSheet.model_validate_json(parts.store.get_bytes(names.job_artifact(job_id, names.JOB_SHEET))).at(frame)
    return Sight(frame, sheet.spec, sheet.stage if sheet.sheets is None else None, name, etag)


def etag_of(sight: Sight, path: str, query: BaseModel) -> str:
    """Return the entity tag, with its quotes, of a picture that is made of a sheet as a query asks."""
    said = f"{sight.etag} {path} {query.model_dump_json()} {package_version()}"
    return f'"{hashlib.sha256(said.encode()).hexdigest()[:32]}"'


def describe(sight: Sight, job_id: str, *, max_px: int) -> schema.Look:
    """Return what a frame shows to those who look into it."""
    layout, spec = sight.layout, sight.spec
    atlas = plan_atlas(layout, max_px=max_px)
    rows, cols = layout.square_size()
    there = set(view_numbers(layout))
    every = ((u, v) for v in range(layout.cell_rows) for u in range(layout.cell_cols))
    return schema.Look(
        frame=sight.frame,
        lattice=layout.lattice,
        lens_rows=layout.lens_rows,
        lens_cols=layout.lens_cols,
        view_rows=rows,
        view_cols=cols,
        us=layout.cell_cols,
        vs=layout.cell_rows,
        missing=tuple(number for number in every if number not in there),
        centre=centre(layout),
        pitch_mm=spec.rig.lens_array.pitch_mm,
        gap_mm=sight.gap_mm,
        viewing_distance_mm=spec.display.viewing_distance_mm,
        depths=_depths(sight),
        atlas=schema.AtlasPlan(
            url=f"{show.API}/jobs/{job_id}/frames/{sight.frame}/views.atlas?max_px={max_px}",
            us=atlas.us, vs=atlas.vs, rows=atlas.rows, cols=atlas.cols,
        ),
    )  # fmt: skip


def _depths(sight: Sight) -> schema.Depths:
    found = shown_depths(sight.spec.rig, sight.stage)
    return schema.Depths.model_validate({name: ended(value) for name, value in vars(found).items()})


def see_view(sheet: Sheet, sight: Sight, query: schema.ViewQuery) -> Light:
    """Return a view on square pixels.

    Raises
    ------
    Invalid
        Naming u or v, if there is no such view.
    """
    layout = sight.layout
    middle_u, middle_v = centre(layout)
    u = middle_u if query.u is None else query.u
    v = middle_v if query.v is None else query.v
    outside = [
        FieldProblem(field=field, expected=f"0 to {count - 1}", got=str(number))
        for field, number, count in (("u", u, layout.cell_cols), ("v", v, layout.cell_rows))
        if not 0 <= number < count
    ]
    if outside:
        raise Invalid("; ".join(map(str, outside)), problems=outside)
    return as_square(view(sheet, layout, u, v), layout)


def see_from(sheet: Sheet, sight: Sight, query: schema.PerspectiveQuery) -> Light:
    """Return what an eye sees, on square pixels; lenses that show it another's light are dark."""
    eye = _eye(sight, query)
    seen = perspective(sight.image(sheet), eye)
    return as_square(seen.picture, sight.layout)


def see_focused(sheet: Sheet, sight: Sight, query: schema.RefocusQuery) -> Light:
    """Return the picture that is sharp at a depth."""
    return refocus(sight.image(sheet), query.depth_mm)


def see_observed(sheet: Sheet, sight: Sight, query: schema.ObserverQuery) -> Light:
    """Return what an observer sees of the display, by rays through pupil and lenses.

    Raises
    ------
    Invalid
        Naming what does not go together.
    LayoutError, OpticsError
        If the gap cannot be built, or the focus does not lie before the eye.
    """
    if query.gap is not None and query.gap_mm is not None:
        problem = FieldProblem(field="gap", expected="either this or gap_mm", got="both")
        raise Invalid(str(problem), problems=[problem])
    spec = sight.spec
    gap_mm = used_gap_mm(spec.rig, spec.display, query.gap, stage=sight.stage) if query.gap else query.gap_mm
    display = observed_display(spec.rig, gap_mm=gap_mm)
    looking = Looking(
        pupil_mm=query.pupil_mm,
        focus_mm=query.focus_mm,
        rays=query.rays,
        stereo=query.stereo,
        eye_distance_mm=query.eye_distance_mm,
    )
    window = whole_window(display, size_px=query.size)
    return look(sheet, display, _eye(sight, query), looking, window=window)


def see_atlas(sheet: Sheet, sight: Sight, query: schema.AtlasQuery) -> Light:
    """Return the views as one picture."""
    return atlas_picture(sight.image(sheet), plan_atlas(sight.layout, max_px=query.max_px))


def _eye(sight: Sight, query: schema.PerspectiveQuery | schema.ObserverQuery) -> Eye:
    distance_mm = sight.spec.display.viewing_distance_mm if query.z is None else query.z
    if distance_mm <= 0:
        problem = FieldProblem(field="z", expected="an eye in front of the display, above 0", got=f"{distance_mm:g}")
        raise Invalid(str(problem), problems=[problem])
    return Eye(x_mm=query.x, y_mm=query.y, distance_mm=distance_mm)


See = Callable[[Sheet, Sight, Any], Light]


def picture(parts: Parts, sheets: Sheets, sight: Sight, query: Any, see: See) -> bytes:
    """Return what is seen as a file.

    Raises
    ------
    Invalid
        If there is no such view or place, or the picture would be too large.
    """
    light = see(sheets.sheet(sight), sight, query)
    scale = query.scale if isinstance(query, schema.Shown) else 1
    longest = max(light.shape[:2]) * scale
    if scale > 1 and longest > MAX_SHOWN_PX:
        problem = FieldProblem(field="scale", expected=f"a picture of at most {MAX_SHOWN_PX} px", got=f"{longest} px")
        raise Invalid(str(problem), problems=[problem])
    how = {"filter_name": query.filter} if isinstance(query, schema.Shown) else {}
    return parts.pictures.shown(light, as_format=query.format, scale=scale, **how)
