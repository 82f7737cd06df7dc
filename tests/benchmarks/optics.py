"""What the optics cost: CPU seconds of the two roads against a pinhole camera with as many pixels, on one thread.

All pictures are made by plain POV-Ray from the texts that a worker writes. Other work on the machine costs wall time
and little CPU, and the cameras take turns: ratios hold on a busy machine too.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lippmann.job.resolved import ResolvedJob
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.pixel_rays import front_mm, outer_rays, pixel_rays
from povtemplates.catalogue import INCLUDE_FOLDER, scene_folders
from tests.builders import local_place, small_job, stored_job
from worker.engines.povray.ray_camera import ray_camera_region, ray_camera_text, scaffold
from worker.engines.povray.scene import RAYS_FILE, pov_text

ROUNDS = 3
"""Each camera is taken so often, in turn, and its least time counts."""

FISH = scene_folders()["fish"]

LENSES = 90
GROWTH_LENSES = 50
GROWTH_PX = (4, 8, 12, 16, 24)
"""Pixels per lens of the growth, as far as the paper's Fig. 8 goes."""

PINHOLE = """#version 3.7;
#include "scene.inc"
// In the front focal point of the paper's lens, with the field of 90 lenses of 1 mm.
camera { perspective location <0, 60, -1056.56> look_at <0, 60, 0> right x up y angle 17.04 }
"""


@dataclass(frozen=True)
class Picture:
    """A text in its folder, and the part that is rendered."""

    folder: Path
    rows: int
    cols: int
    first_row: int = 0
    scene: Path = FISH
    """The folder of the scene that the text includes."""

    def cpu_s(self) -> float:
        """Return the CPU seconds of rendering it."""
        return spent_s(self._render)

    def _render(self) -> None:
        subprocess.run(
            [
                *("povray", "+Iframe.pov", "+Oframe.exr", "+FE", f"+W{self.cols}", f"+H{self.rows}"),
                *(f"+SR{self.first_row + 1}", f"+ER{self.rows}", "-D", "-A", "+WT1", "+K0"),
                *(f"+L{self.scene}", f"+L{INCLUDE_FOLDER}"),
            ],
            check=True,
            capture_output=True,
            cwd=self.folder,
        )


def glass_ratio(folder: Path) -> str:
    """Return the CPU of modelled glass against that of a pinhole camera, 90 x 90 lenses at 8 px."""
    sheet = fish(folder, lenses=LENSES, px_per_lens=8)
    pinhole, glass = pinhole_picture(folder / "pinhole", sheet), glass_picture(folder / "glass", sheet)
    pinhole_s, glass_s = zip(*((pinhole.cpu_s(), glass.cpu_s()) for _ in range(ROUNDS)), strict=True)
    return f"{min(glass_s) / min(pinhole_s):.2f} ({min(glass_s):.2f} / {min(pinhole_s):.2f} s)"


def ray_camera_ratio(folder: Path) -> str:
    """Return the CPU of the ray camera, its trace and its text with it, against that of a pinhole camera."""
    sheet = fish(folder, lenses=LENSES, px_per_lens=8)
    pinhole = pinhole_picture(folder / "pinhole", sheet)
    pinhole_s, rays_s = [], []
    for number in range(ROUNDS):
        pinhole_s.append(pinhole.cpu_s())
        rays_s.append(ray_camera_s(folder / f"rays-{number}", sheet))
    return f"{min(rays_s) / min(pinhole_s):.2f} ({min(rays_s):.2f} / {min(pinhole_s):.2f} s)"


def growth(folder: Path) -> str:
    """Return how far the CPU of modelled glass is from growing with the pixels, over pixels per lens (Fig. 8).

    The line is that of least relative squares; its largest relative deviation is told.
    """
    sheets = [fish(folder / str(n), lenses=GROWTH_LENSES, px_per_lens=n) for n in GROWTH_PX]
    pictures = [glass_picture(folder / str(n) / "glass", sheet) for n, sheet in zip(GROWTH_PX, sheets, strict=True)]
    cpu_s = np.min([[picture.cpu_s() for picture in pictures] for _ in range(ROUNDS)], axis=0)
    pixels = np.array([picture.rows * picture.cols for picture in pictures], float)
    terms = np.stack([np.ones_like(pixels), pixels], axis=1) / cpu_s[:, np.newaxis]
    line, *_ = np.linalg.lstsq(terms, np.ones_like(pixels), rcond=None)
    return f"{100 * np.abs(terms @ line - 1).max():.1f} % ({1e6 * line[1]:.1f} us/px)"


def fish(folder: Path, *, lenses: int, px_per_lens: int) -> ResolvedJob:
    """Return a stored job of a square sheet over the fish."""
    spec = small_job("fish", count=(lenses, lenses), px_per_lens=px_per_lens)
    return stored_job(local_place(folder / "data"), spec).at(1)


def side_px(sheet: ResolvedJob) -> int:
    """Return the rows, and the cols, of a sheet."""
    return sheet.spec.rig.lens_array.count[0] * sheet.spec.rig.px_per_lens


def pinhole_picture(folder: Path, sheet: ResolvedJob) -> Picture:
    """Return the scene as an ordinary camera sees it."""
    return written(folder, PINHOLE, sheet)


def glass_picture(folder: Path, sheet: ResolvedJob) -> Picture:
    """Return the sheet through modelled glass."""
    return written(folder, pov_text(sheet, "glass"), sheet)


def written(folder: Path, text: str, sheet: ResolvedJob) -> Picture:
    """Write a text to where it is rendered."""
    folder.mkdir(parents=True)
    (folder / "frame.pov").write_text(text)
    return Picture(folder, rows=side_px(sheet), cols=side_px(sheet))


def ray_camera_s(folder: Path, sheet: ResolvedJob, *, scene: Path = FISH) -> float:
    """Return the CPU seconds of a sheet by the ray camera, from the trace on; `scene` is the folder of its scene."""
    folder.mkdir(parents=True)
    side = side_px(sheet)
    region = ray_camera_region(rows=side, cols=side)

    def write() -> None:
        optical_bench = bench(sheet.spec.rig, reference_mm=sheet.stage.reference_mm)
        rays = pixel_rays(optical_bench, rows=side, cols=side)
        shared = scaffold(
            outer_rays(optical_bench), front_mm=front_mm(optical_bench), mm_per_unit=sheet.stage.mm_per_unit
        )
        text = b"".join(ray_camera_text([rays], rays.position[..., 0].size, shared))
        (folder / RAYS_FILE).write_bytes(text)
        (folder / "frame.pov").write_text(pov_text(sheet, "ray_camera"))

    picture = Picture(folder, rows=region.row_stop, cols=side, first_row=region.row_start, scene=scene)
    return spent_s(write) + picture.cpu_s()


def spent_s(work: Callable[[], object]) -> float:
    """Return the CPU seconds of this process and its ended children that some work takes."""
    before = os.times()
    work()
    after = os.times()
    return sum(after[:4]) - sum(before[:4])
