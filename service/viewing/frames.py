"""Finds a frame that can be viewed, and describes its views."""

from __future__ import annotations

import hashlib

from pydantic import BaseModel
from sqlalchemy.orm import Session

from lippmann.errors import ArtifactMissing, FieldProblem
from lippmann.job.resolved import ResolvedJob
from lippmann.lightfield.views.atlas import plan_atlas
from lippmann.lightfield.views.views import centre, view_numbers
from lippmann.plan import artifact_names as names
from lippmann.plan.design.depths import shown_depths
from lippmann.plan.design.lens import ended
from lippmann.plan.sampling import display_size
from service.errors import Invalid, NotFound
from service.health import package_version
from service.jobs.state_machine import find_job
from service.ports import Parts
from service.schemas import viewing as schema
from service.schemas.links import atlas_url, depth_map_url
from service.viewing.depth import TrueDepth
from service.viewing.viewable_frame import ViewableFrame

FIRST_ATLAS_PX = 540
"""The longest side of the atlas of a first picture; that of the fish over water has 141 kB as WebP."""
MAX_SHEET_PX = 2**27
"""The largest integral image that can be viewed: 0.8 GB, and up to six times as much while it is refocused."""


def find_frame(session: Session, parts: Parts, job_id: str, frame: int) -> ViewableFrame:
    """Find a frame whose views can be requested.

    Raises
    ------
    NotFound
        If the job does not exist, or has no such frame.
    ArtifactMissing
        If the frame is not assembled yet.
    Invalid
        If its integral image is too large to keep in memory.
    """
    spec = find_job(session, job_id).parsed_spec
    if frame not in spec.frame_numbers:
        raise NotFound(f"job {job_id!r} has the frames {spec.frames}, not {frame}")
    layout = display_size(spec.rig)
    if layout.rows * layout.cols > MAX_SHEET_PX:
        expected = f"an integral image of at most {MAX_SHEET_PX} px; larger ones can only be used by outputs"
        problem = FieldProblem(field="frame", expected=expected, got=f"{layout.rows} x {layout.cols} px")
        raise Invalid(str(problem), problems=[problem])
    name = names.job_artifact(job_id, names.orthoscopic_name(frame))
    try:
        etag = parts.store.etag(name)
    except ArtifactMissing as error:
        raise ArtifactMissing(f"frame {frame} of job {job_id!r} is not assembled yet") from error
    sheet = ResolvedJob.model_validate_json(parts.store.get_bytes(names.job_artifact(job_id, names.JOB_FILE))).at(frame)
    stage = sheet.stage if sheet.sheets is None else None
    has_depth = stage is not None and sheet.spec.capture.depth
    depth_name = names.job_artifact(job_id, names.depth_name(frame)) if has_depth else None
    return ViewableFrame(frame, sheet.spec, stage, name, etag, depth_name)


def etag_of(frame: ViewableFrame, path: str, query: BaseModel, true_depth: TrueDepth | None = None) -> str:
    """Return the entity tag, with its quotes, of what a query makes of a frame, and of its true depth."""
    source = frame.etag if true_depth is None else f"{frame.etag} {true_depth.etag}"
    text = f"{source} {path} {query.model_dump_json()} {package_version()}"
    return f'"{hashlib.sha256(text.encode()).hexdigest()[:32]}"'


def describe(frame: ViewableFrame, job_id: str, *, max_px: int) -> schema.FrameViews:
    """Describe the views of a frame."""
    layout, spec = frame.layout, frame.spec
    rows, cols = layout.square_size()
    whole = _atlas(frame, job_id, max_px=max_px)
    is_small = max(whole.rows, whole.cols) <= FIRST_ATLAS_PX
    first_px = min(max_px, max(FIRST_ATLAS_PX, rows, cols))
    existing = set(view_numbers(layout))
    every = ((u, v) for v in range(layout.cell_rows) for u in range(layout.cell_cols))
    return schema.FrameViews(
        frame=frame.frame,
        lattice=layout.lattice,
        lens_rows=layout.lens_rows,
        lens_cols=layout.lens_cols,
        view_rows=rows,
        view_cols=cols,
        us=layout.cell_cols,
        vs=layout.cell_rows,
        missing=tuple(number for number in every if number not in existing),
        centre=centre(layout),
        pitch_mm=spec.rig.lens_array.pitch_mm,
        gap_mm=frame.gap_mm,
        viewing_distance_mm=spec.display.viewing_distance_mm,
        depths=_depths(frame),
        atlas=whole,
        first_atlas=whole if is_small else _atlas(frame, job_id, max_px=first_px),
        depth_map=schema.DepthMapPlan(
            url=depth_map_url(job_id, frame.frame), source="estimate" if frame.depth_name is None else "truth",
        ),
    )  # fmt: skip


def _atlas(frame: ViewableFrame, job_id: str, *, max_px: int) -> schema.AtlasPlan:
    atlas = plan_atlas(frame.layout, max_px=max_px)
    return schema.AtlasPlan(
        url=atlas_url(job_id, frame.frame, max_px=max_px), us=atlas.us, vs=atlas.vs, rows=atlas.rows, cols=atlas.cols
    )


def _depths(frame: ViewableFrame) -> schema.Depths:
    found = shown_depths(frame.spec.rig, frame.stage)
    return schema.Depths.model_validate({name: ended(value) for name, value in vars(found).items()})
