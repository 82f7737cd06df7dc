"""The probe of a scene: its camera, and notes on what a farm or the rig does otherwise than POV-Ray does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import OutOfMemory, Permanent, RenderStalled, RenderTimedOut
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene_camera import SceneCamera
from worker.engines.povray.scenes.scene_variables import SceneVariables, scene_variables
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.scenes.scene_camera import no_camera, read_scene_camera

_NAMED = 3
"""The greatest number of files that a note names."""

MIRRORED = (
    "The camera of the scene is mirror-imaged, as in scenes with right-handed axes, so the rig is too, and text is "
    'readable; `handedness = "left"` in the stage shows the scene mirror-imaged.'
)
MOVES = (
    "The camera of the scene moves and the rig does not; with `follow_camera = true` in the stage the rig moves as the "
    "camera does."
)
UNKNOWN = (
    "The camera of the scene could not be read, so the scene counts as left-handed, as POV-Ray is; `handedness` in the "
    "stage says it."
)


@dataclass(frozen=True)
class SceneFindings:
    """The results of examining a scene."""

    camera: SceneCamera | None
    """The camera of the scene at frame 1, if the stage of the job depends on it."""
    notes: tuple[str, ...]


def examine_scene(
    place: Workplace, sheet: ResolvedJob, *, folder: Path, log: AttemptLog, monitor: ProgressMonitor
) -> SceneFindings:
    """Examine the scene of a job: read its camera, and collect notes.

    Raises
    ------
    SceneError
        If the rig follows the camera of a scene that has none.
    """
    with place.bundle(sheet.bundle) as unpacked:
        variables = scene_variables(unpacked)
    reader = _CameraReader(place, sheet, folder, log, monitor)
    stage = sheet.stage
    notes = [written_files_note(variables.writes)] if variables.writes else []
    if stage.follow_camera:
        first = reader.camera(1)
        if first is None:
            raise no_camera(1)
    else:
        asks = variables.has_camera(sheet.file) and stage.handedness == "auto"
        # A job need not render frame 1, so the scene may fail there.
        first = reader.quiet_camera(1) or reader.quiet_camera(sheet.spec.frame_numbers[0]) if asks else None
        if asks and first is None:
            notes.append(UNKNOWN)
        if variables.has_camera(sheet.file) and _may_move(variables) and reader.moves(sheet.spec.frame_numbers):
            notes.append(MOVES)
    is_mirrored = stage.handedness == "auto" and first is not None and first.handedness == "right"
    if is_mirrored:
        notes.append(MIRRORED)
    return SceneFindings(camera=first if is_mirrored or stage.follow_camera else None, notes=tuple(notes))


def _may_move(variables: SceneVariables) -> bool:
    return variables.clock or variables.frames


class _CameraReader:
    """Reads the camera of a scene at frames, each once."""

    def __init__(
        self, place: Workplace, sheet: ResolvedJob, folder: Path, log: AttemptLog, monitor: ProgressMonitor
    ) -> None:
        self._place, self._sheet, self._folder, self._log, self._monitor = place, sheet, folder, log, monitor
        self._read: dict[int, SceneCamera | None] = {}

    def camera(self, frame: int) -> SceneCamera | None:
        """Return the camera at a frame; see `read_scene_camera`."""
        if frame not in self._read:
            self._read[frame] = read_scene_camera(
                self._place, self._sheet, frame, folder=self._folder, log=self._log, monitor=self._monitor
            )
        return self._read[frame]

    def quiet_camera(self, frame: int) -> SceneCamera | None:
        """Return the camera at a frame, or None if the scene fails there: the job may not render that frame.

        A failure that another attempt may not meet says nothing of the scene: the attempt fails by it.
        """
        try:
            return self.camera(frame)
        except (Permanent, RenderStalled, RenderTimedOut, OutOfMemory) as error:
            self._log.write(f"The camera of frame {frame} could not be read: {error}")
            return self._read.setdefault(frame)

    def moves(self, frames: tuple[int, ...]) -> bool:
        """Return whether the camera at the first frame differs from that in the middle or at the end."""
        if len(frames) == 1:
            return False
        first = self.quiet_camera(frames[0])
        return first is not None and any(now is not None and not now.is_at(first) for now in self._later(frames))

    def _later(self, frames: tuple[int, ...]) -> Iterator[SceneCamera | None]:
        # A third of the way, since an orbit is where it began at the end and may be so in the middle.
        for frame in dict.fromkeys((frames[len(frames) // 3], frames[-1])):
            yield self.quiet_camera(frame)


def written_files_note(files: tuple[str, ...]) -> str:
    """Return the note on a scene whose files open files for writing.

    >>> written_files_note(("state.inc",)).partition(":")[0]
    'The scene writes files (in state.inc)'
    """
    more = f" and {len(files) - _NAMED} more" if len(files) > _NAMED else ""
    return (
        f"The scene writes files (in {', '.join(files[:_NAMED])}{more}): every frame begins with the files of the "
        "bundle and finds nothing that another frame has written. A state that passes from frame to frame has to be "
        "computed from the clock or frame_number."
    )
