"""The stage of a preview. A scene of POV-Ray may have a camera that says how its axes are, or carries the rig."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path

from pydantic import ValidationError

from lippmann.errors import OutOfMemory, Permanent, SceneError
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene_camera import SceneCamera, followed_stage
from lippmann.job.scenes.stage import Stage
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.scenes.scene_camera import no_camera, read_scene_camera, upright_stage

MOST_CAMERAS = 100


class KnownCameras:
    """The cameras that scenes have shown, each for one owner; a camera depends on neither stage nor rig."""

    def __init__(self) -> None:
        self._cameras: OrderedDict[tuple[object, ...], SceneCamera | None] = OrderedDict()

    def stage(
        self, place: Workplace, job: ResolvedJob, frame: int, *, folder: Path, log: AttemptLog, monitor: ProgressMonitor
    ) -> Stage:
        """Return the stage at which a preview is rendered, with a handedness that is known.

        Parameters
        ----------
        job
            The job at the frame.
        folder
            The folder of the preview.

        Raises
        ------
        SceneError
            If the rig follows a camera that no report shows.
        LippmannError
            Whatever the scene fails with.
        """
        stage = job.stage
        needs_camera = stage.follow_camera or stage.handedness == "auto"
        if job.engine != "povray" or not needs_camera:
            return upright_stage(job, None)

        def camera(number: int) -> SceneCamera | None:
            key = (
                job.cache_scope,
                job.bundle,
                job.file,
                tuple(sorted(job.parameters.items())),
                job.clock.model_dump_json(),
                number,
            )
            if key not in self._cameras:
                self._cameras[key] = read_scene_camera(place, job, number, folder=folder, log=log, monitor=monitor)
                if len(self._cameras) > MOST_CAMERAS:
                    self._cameras.popitem(last=False)
            return self._cameras[key]

        if not stage.follow_camera:
            try:
                return upright_stage(job, camera(1))
            except (Permanent, OutOfMemory):
                if frame == 1:
                    raise
                return upright_stage(job, camera(frame))  # frame 1 may fail where the frame of the preview does not
        first, now = camera(1), camera(frame)
        if first is None or now is None:
            raise no_camera(frame)
        upright = upright_stage(job, first)
        try:
            return followed_stage(upright, first=first, now=now)
        except ValidationError as error:
            raise SceneError(f"frame {frame}: the rig follows the camera to where no stage can be") from error
