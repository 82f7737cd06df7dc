"""The scene's own camera: where it stands at a frame, and where the rig stands by it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import SceneError
from lippmann.job.messages.orders import Order
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene_camera import SceneCamera, followed_stage
from lippmann.job.scenes.stage import Stage
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import cut_tiles, frame_size
from worker.engines.povray.command import RenderCommand
from worker.engines.povray.pictures.pixels import read_codes
from worker.engines.povray.scenes.scene_camera import (
    COLS,
    QUALITY,
    ROWS,
    SCALES,
    read_location,
    read_vectors,
    report_text,
    scene_camera,
)
from worker.engines.povray.scenes.scene_variables import scene_variables
from worker.images.read import read_attributes
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.artifacts import TaskArtifacts, naming_artifact
from worker.tasks.attempts.monitor import PartMonitor, ProgressMonitor
from worker.tasks.attempts.workplace import Workplace, kept_log
from worker.tasks.frames.picture import run_povray

REPORT_FILE = "lippmann-camera.pov"


def read_scene_camera(
    place: Workplace, sheet: ResolvedJob, frame: int, *, folder: Path, log: AttemptLog, monitor: ProgressMonitor
) -> SceneCamera | None:
    """Return the camera of a scene at a frame; None if the scene has none, or one that no report shows.

    Parameters
    ----------
    folder
        The folder of the task.

    Raises
    ------
    LippmannError
        Whatever the scene fails with.
    """
    with place.bundle(sheet.bundle) as bundle:
        has_camera = scene_variables(bundle).has_camera(sheet.file)
    if not has_camera:
        return None
    there = sheet.at(frame)
    silent = PartMonitor(monitor, 0.0, 0.0)

    def codes(what: Literal["vectors", "location"], scale: float = 1.0) -> NDArray[np.uint16]:
        (folder / REPORT_FILE).write_text(report_text(there, what, scale=scale))
        command = RenderCommand(
            pov_file=REPORT_FILE,
            picture="lippmann-camera.ppm",
            cols=COLS,
            rows=ROWS,
            picture_format="ppm16",
            clock=sheet.clock.at(frame),
            declares=sheet.clock.variables(frame),
            quality=QUALITY,
        )
        return read_codes(run_povray(place, there, command, folder=folder, log=log, monitor=silent).picture)

    vectors = read_vectors(codes("vectors"))
    if vectors is None:
        return None
    for scale in SCALES:
        location = read_location(codes("location", scale), scale=scale)
        if location is not None:
            try:
                return scene_camera(vectors, location)
            except ValidationError:  # Too far away for a stage.
                return None
    return None


def rendered_job(place: Workplace, order: Order, monitor: ProgressMonitor) -> ResolvedJob:
    """Return the job of a frame with the stage at which it is rendered.

    The handedness of the stage is that of the scene's camera, which the probe has read. A rig that follows the camera
    stands where the camera of the frame puts it; POV-Ray reports that camera here, in every task of the frame alike.

    Raises
    ------
    SceneError
        If the rig follows a camera that no report shows.
    LippmannError
        Whatever the scene fails with.
    """
    assert order.frame is not None  # noqa: S101 - the order is for a frame
    sheet, plan = place.job_sheet(order.job_id), place.plan_sheet(order.job_id)
    stage = upright_stage(sheet.at(order.frame), plan.camera)
    if stage.follow_camera:
        with place.task_folder() as folder, kept_log(place, order, folder) as log:
            now = read_scene_camera(place, sheet, order.frame, folder=folder, log=log, monitor=monitor)
            if plan.camera is None or now is None:
                raise no_camera(order.frame)
            try:
                stage = followed_stage(stage, first=plan.camera, now=now)
            except ValidationError as error:
                raise SceneError(f"frame {order.frame}: the rig follows the camera to where no stage can be") from error
    return sheet.placed(stage, order.frame)


def assembled_job(place: Workplace, order: Order, artifacts: TaskArtifacts) -> ResolvedJob:
    """Return the job of a frame with the stage at which its tiles were rendered; see `rendered_job`."""
    assert order.frame is not None  # noqa: S101 - the order is for a frame
    sheet = place.job_sheet(order.job_id)
    if sheet.sheets is not None:
        return sheet
    plan = place.plan_sheet(order.job_id)
    stage = upright_stage(sheet.at(order.frame), plan.camera)
    if stage.follow_camera:
        first, *_ = cut_tiles(frame_size(sheet.spec.rig), tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
        name = names.tile_name(order.frame, first.index)
        with naming_artifact(name), artifacts.opened(name) as path:
            stage = Stage.model_validate_json(read_attributes(path)["stage"])
    return sheet.placed(stage, order.frame)


def upright_stage(job: ResolvedJob, camera: SceneCamera | None) -> Stage:
    """Return the stage of a job with a handedness that is known.

    It is that of the stage or of the scene's camera; without either, POV-Ray's scenes are left-handed and Mitsuba's
    right-handed.
    """
    stage = job.stage
    if stage.handedness != "auto":
        return stage
    of_engine = "left" if job.engine == "povray" else "right"
    return stage.model_copy(update={"handedness": camera.handedness if camera else of_engine})


def no_camera(frame: int) -> SceneError:
    """Return the error of a rig that follows the camera of a scene that shows none."""
    return SceneError(
        f"stage.follow_camera: expected a scene with a camera that POV-Ray can report, got none at frame {frame}"
    )
