"""The view of the scene's own camera: how far away the objects are, and what stands behind the camera."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene_camera import SceneCamera
from worker.engines.povray.command import RenderCommand
from worker.engines.povray.pictures.depth_codes import FOGGY, FogLight, fog_light, fog_light_among_others
from worker.engines.povray.pictures.pixels import read_codes
from worker.engines.povray.scenes.scene_camera import (
    COLS,
    ROWS,
    WIDTH_SCALES,
    along_axis,
    distances_text,
    read_width,
    report_text,
)
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.depth_pass import has_fog
from worker.tasks.frames.picture import run_povray

DISTANCES_FILE = "lippmann-distances.pov"

_FIRST_SCALES = (10.0, 1e4, 1e-2)
"""The scales of distances that are tried until something is seen, scene units."""
_SAME_WIDTH = 0.2
_NARROW = 0.02
"""The width of the picture at distance 1 when looking backward."""


@dataclass(frozen=True)
class OwnView:
    """The depths of what a camera sees, in scene units along its axis."""

    near: float
    """The depth that a twentieth of the visible points are nearer than."""
    middle: float
    far: float
    """The depth that a twentieth of the visible points are farther than."""
    behind: float | None
    """The distance of the nearest object behind the camera on its axis; None without such an object."""
    width: float | None = None
    """The width of what an orthographic camera sees; None for a camera of another kind."""


def own_view(
    place: Workplace, sheet: ResolvedJob, camera: SceneCamera, *, folder: Path, log: AttemptLog
) -> OwnView | None:
    """Measure what a camera sees at frame 1; None if it sees no object, or stands inside one.

    Raises
    ------
    LippmannError
        Whatever the scene fails with.
    """
    room = _Room(place, sheet, folder, log)
    width = room.width()
    seen = room.distances(camera if width is None else None)
    if seen is None:
        return None
    depths = seen if width is not None else along_axis(seen, camera)
    near, middle, far = (float(value) for value in np.nanpercentile(depths, (5, 50, 95)))
    x, y, z = camera.direction
    backward = camera.model_copy(
        update={
            "direction": (-x, -y, -z),
            "right": tuple(_NARROW * share for share in camera.right),
            "up": tuple(_NARROW * share for share in camera.up),
        }
    )
    behind = room.distances(backward)
    return OwnView(near, middle, far, None if behind is None else float(np.nanmin(behind)), width)


@dataclass(frozen=True)
class _Room:
    place: Workplace
    sheet: ResolvedJob
    folder: Path
    log: AttemptLog

    def width(self) -> float | None:
        """Return the width of what the scene's camera sees if its rays are parallel, scene units."""
        for scale in WIDTH_SCALES:
            width = self._width(scale)
            if width is not None:
                # What a perspective camera sees of the wall is as wide at every scale of the scene.
                other = self._width(scale / 2)
                return width if other is not None and abs(other / width - 1) < _SAME_WIDTH else None
        return None

    def _width(self, scale: float) -> float | None:
        return read_width(self._codes(report_text(self.sheet.at(1), "width", scale=scale)), scale=scale)

    def distances(self, camera: SceneCamera | None) -> NDArray[np.float64] | None:
        """Return the distances along the rays of a camera, or of that of the scene; None if no ray meets an object."""
        for scale in _FIRST_SCALES:
            found = self._light(camera, scale).distance_mm(near_mm=scale)
            if not np.isfinite(found).any():
                continue
            middle = float(np.nanmedian(found))
            if scale / 20 < middle < 20 * scale:
                return found
            return self._light(camera, middle).distance_mm(near_mm=middle)
        return None

    def _light(self, camera: SceneCamera | None, scale: float) -> FogLight:
        with self.place.bundle(self.sheet.bundle) as bundle:
            foggy = has_fog(bundle)
        if foggy:
            return fog_light_among_others(*(self._fog_codes(camera, scale, amount) for amount in (0.0, FOGGY, -FOGGY)))
        return fog_light(self._fog_codes(camera, scale, 1.0))

    def _fog_codes(self, camera: SceneCamera | None, scale: float, amplitude: float) -> NDArray[np.uint16]:
        return self._codes(distances_text(self.sheet, near=scale, amplitude=amplitude, camera=camera))

    def _codes(self, text: str) -> NDArray[np.uint16]:
        (self.folder / DISTANCES_FILE).write_text(text)
        command = RenderCommand(
            pov_file=DISTANCES_FILE,
            picture="lippmann-distances.ppm",
            cols=COLS,
            rows=ROWS,
            picture_format="ppm16",
            clock=self.sheet.clock.at(1),
            declares=self.sheet.clock.variables(1),
        )
        outcome = run_povray(self.place, self.sheet, command, folder=self.folder, log=self.log, monitor=NullMonitor())
        return read_codes(outcome.picture)
