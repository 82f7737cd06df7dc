"""A worker played by the test: it hands in real pictures and videos, one order at a time, when it is told to."""

from __future__ import annotations

import json
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.farm.adapters import make_parts
from lippmann.job.messages.events import Event, EventKind, Failure
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.resolved import ResolvedJob
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.views import grid_size, interlace, view_numbers, view_of_grid
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import Moved, unwatched
from lippmann.plan.sampling import display_size
from service.ports import Parts
from tests.builders_service import DictStore, claimed, done, event, heartbeat
from worker.images.colour import srgb_codes
from worker.images.write import write_exr, write_png, write_thumbnail
from worker.store.opening import local_store
from worker.video.encode import encode
from worker.video.kinds import FFV1, H264, kind

LENSES, PX = 12, 8
KINDS = {".mp4": H264, ".webm": kind("vp9"), ".mkv": FFV1}
RIG = {"lens_array": {"count": [LENSES, LENSES]}, "px_per_lens": PX}
BAR_MM = PX * 3.3
"""Depth of the bar in coded views: as many focal lengths as there are views."""
SPEC: dict[str, Any] = {"scene": "fish", "title": "A pond", "frames": "1-6", "rig": RIG, "render": {"tiles": [1, 1]}}
"""Probe, then a render and an assembly for each of 6 frames, then 3 videos."""


class FileStore(DictStore):
    """A store in memory that lends real files."""

    @contextmanager
    def local_path(self, name: str, *, moved: Moved = unwatched) -> Iterator[Path]:
        with tempfile.NamedTemporaryFile(suffix=Path(name).suffix) as file:
            file.write(self.get_bytes(name))
            file.flush()
            yield Path(file.name)


def parts(folder: Path) -> Parts:
    return replace(make_parts(local_store(folder)), store=FileStore())


def view(frame: int, px: int) -> NDArray[np.float32]:
    """Return a disc that wanders to the right over a gradient, `(px, px, 3)`."""
    row, col = np.mgrid[0:px, 0:px] / px
    disc = (row - 0.5) ** 2 + (col - 0.2 - 0.1 * (frame % 7)) ** 2 < 0.03
    light = np.stack([0.1 + 0.5 * col, 0.3 + 0.3 * row, 0.6 - 0.3 * row], axis=-1)
    return np.where(disc[..., None], [0.9, 0.45, 0.1], light).astype(np.float32)


def coded_view(layout: CellLayout, frame: int, u: int, v: int) -> NDArray[np.float32]:
    """Return a view that tells which it is, `(lens_rows, lens_cols, 3)`: red u, green v, blue the frame.

    And a blue bar that moves by a lens against the eye from view to view: it floats `BAR_MM` before the display.
    """
    picture = np.empty((layout.lens_rows, layout.lens_cols, 3), dtype=np.float32)
    picture[:] = 0.1 + 0.8 * u / (layout.cell_cols - 1), 0.1 + 0.8 * v / (layout.cell_rows - 1), 0.1 * frame
    picture[:, (layout.lens_cols + layout.cell_cols) // 2 - 1 - u, 2] = 1
    return picture


def coded_sheet(layout: CellLayout, frame: int) -> NDArray[np.float32]:
    """Return the orthoscopic sheet of all coded views; what no view shows is black."""
    grid = np.zeros((*grid_size(layout), 3), dtype=np.float32)
    for u, v in view_numbers(layout):
        view_of_grid(grid, layout, u, v)[:] = coded_view(layout, frame, u, v)
    return interlace(grid, layout)


class Studio:
    """Answers orders. Held back, it hands in one order for every `let`; otherwise all at once."""

    def __init__(self, store: Any, *, picture: Callable[[int, int], NDArray[np.float32]] = view) -> None:
        self.faults: dict[tuple[TaskKind, int | None], str] = {}
        """What POV-Ray says of a task instead of rendering it: the job ends with it."""
        self.has_cache = False
        """True if every tile comes from the render cache."""
        self.store, self._picture = store, picture
        self._go = threading.Semaphore(0)
        self._is_held = False

    def hold(self) -> None:
        """Wait for `let` before each order that is not the probe."""
        self._is_held = True

    def let(self, orders: int = 1) -> None:
        """Let so many orders be done."""
        self._go.release(orders)

    def __call__(self, order: Order) -> Iterator[Event]:
        yield claimed(order)
        yield heartbeat(order, 0.3)
        if self._is_held and order.kind is not TaskKind.PROBE:
            self._go.acquire()
        message = self.faults.get((order.kind, order.frame))
        if message is not None:
            self.store.put_bytes(names.job_artifact(order.job_id, self._log_name(order)), message.encode())
            yield event(order, EventKind.FAILED, failure=Failure(code="scene", message=message, permanent=True))
            return
        self._make(order)
        yield done(order).model_copy(update={"cached": self.has_cache and order.kind is TaskKind.RENDER})

    def _log_name(self, order: Order) -> str:
        return names.log_name(order.kind, order.frame, order.tile, order.output, order.attempt_number)

    def _make(self, order: Order) -> None:
        with tempfile.TemporaryDirectory() as folder:
            scratch = Path(folder) / "scratch"
            if order.kind is TaskKind.ASSEMBLE:
                assert order.frame is not None
                self.assemble(order.job_id, order.frame, scratch)
            elif order.kind is TaskKind.ENCODE:
                assert order.output is not None
                if order.output == "view_grid.png":
                    self._export(order.job_id, Path(folder))
                    return
                if order.output == "quilt.png":
                    self._export_quilt(order.job_id, Path(folder))
                    return
                frames = (srgb_codes(self._picture(frame, 240)) for frame in range(1, 7))
                encode(scratch, frames, kind=KINDS[Path(order.output).suffix], fps=8)
                self._put(order.job_id, f"video/{order.output}", scratch)

    def _export(self, job_id: str, folder: Path) -> None:
        """Hand in an output of a file a frame, and what is told beside it."""
        files = [f"exports/view_grid/{names.frame_stem(frame)}.png" for frame in range(1, 7)]
        for frame, name in enumerate(files, 1):
            write_png(folder / "grid.png", self._picture(frame, LENSES))
            self._put(job_id, name, folder / "grid.png")
        told = json.dumps({"files": files}).encode()
        self.store.put_bytes(names.job_artifact(job_id, "exports/view_grid.png.json"), told)

    def _export_quilt(self, job_id: str, folder: Path) -> None:
        """Hand in a quilt of the first frame, whose tiles are in a row, and what is told beside it."""
        name = f"exports/quilt/{names.frame_stem(1)}_qs{PX}x1a1.png"
        write_png(folder / "quilt.png", np.hstack([self._picture(tile, LENSES) for tile in range(PX)]))
        self._put(job_id, name, folder / "quilt.png")
        told = json.dumps({"files": [name], "columns": PX, "rows": 1, "aspect": 1.0}).encode()
        self.store.put_bytes(names.job_artifact(job_id, "exports/quilt.png.json"), told)

    def assemble(self, job_id: str, frame: int, scratch: Path) -> None:
        """Hand in the pictures of a frame."""
        picture = self._picture(frame, LENSES * PX)
        sheet = ResolvedJob.model_validate_json(self.store.get_bytes(names.job_artifact(job_id, names.JOB_FILE)))
        masters = {
            names.integral_name(frame): picture,
            names.orthoscopic_name(frame): coded_sheet(display_size(sheet.spec.rig), frame),
            names.views_name(frame): picture,
        }
        for name, light in masters.items():
            write_exr(scratch, light, attributes={})
            self._put(job_id, name, scratch)
        write_thumbnail(scratch, picture)
        self._put(job_id, names.thumb_name(frame), scratch)

    def assemble_alike(self, job_id: str, frames: Sequence[int]) -> None:
        """Hand in the pictures of the first of some frames for all of them."""
        with tempfile.TemporaryDirectory() as folder:
            self.assemble(job_id, frames[0], Path(folder) / "scratch")
        for name_of in (names.integral_name, names.orthoscopic_name, names.views_name, names.thumb_name):
            picture = self.store.get_bytes(names.job_artifact(job_id, name_of(frames[0])))
            for frame in frames[1:]:
                self.store.put_bytes(names.job_artifact(job_id, name_of(frame)), picture)

    def _put(self, job_id: str, name: str, scratch: Path) -> None:
        self.store.put_file(names.job_artifact(job_id, name), scratch)
