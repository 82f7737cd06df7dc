"""A coding study of a job's frames, or of a folder of them: numbers as CSV and JSON, curves as a plot."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lippmann.errors import BadInput, OutputError
from lippmann.job.outputs.codecs import Chroma
from lippmann.lattice.layout import CellLayout
from lippmann.local.codec_rates import Arrangement, Codes, Encoder, Point, Sequence8, savings, study
from lippmann.local.compare import find_frames
from lippmann.local.files.master import named_rig, whole_picture
from lippmann.local.files.writable import check_writable
from lippmann.local.plot import COLOURS, axes, check_plots
from lippmann.plan.sampling import display_size
from lippmann.terminal.progress import ProgressLine
from worker.images.codes import picture_codes

NAME = "coding-study"
_MARKS: dict[Arrangement, str] = {"sheets": "o-", "views": "s--"}


@dataclass(frozen=True)
class Wanted:
    """What a study is to try."""

    codecs: tuple[Encoder, ...]
    arrangements: tuple[Arrangement, ...]
    qps: tuple[int, ...]
    chroma: Chroma
    intra: bool


@dataclass(frozen=True)
class Studied:
    """What it found, and where that lies."""

    points: tuple[Point, ...]
    bd_rates: dict[tuple[Encoder, Arrangement], float]
    frames: int
    layout: CellLayout
    files: tuple[Path, ...]


def study_here(folder: Path, wanted: Wanted, *, fps: float, out: Path) -> Studied:
    """Study the frames of a folder, and write `coding-study.csv`, `.json` and `.png`.

    Raises
    ------
    BadInput
        If there are no frames, they have different lenses or no rig in their headers, or a codec does not have a
        quantizer or the chroma.
    LippmannError
        If matplotlib is missing.
    """
    check_plots()
    check_writable(out)
    video = _video(folder, fps)
    points: list[Point] = []
    try:
        with ProgressLine(NAME) as line:
            for point in study(
                video,
                codecs=wanted.codecs,
                arrangements=wanted.arrangements,
                qps=wanted.qps,
                chroma=wanted.chroma,
                intra=wanted.intra,
                tell=line.show,
            ):
                points.append(point)
    except OutputError as error:
        raise BadInput(error.message) from error
    files = tuple(out / f"{NAME}{suffix}" for suffix in (".csv", ".json", ".png"))
    studied = Studied(tuple(points), savings(points), video.count, video.layout, files)
    _write_csv(files[0], points)
    files[1].write_text(json.dumps(study_data(studied, wanted), indent=1) + "\n")
    _plot(files[2], studied, wanted)
    return studied


def study_data(studied: Studied, wanted: Wanted) -> dict[str, Any]:
    """Return everything for programs; null is an infinite or an unknown number."""
    layout = studied.layout
    return {
        "frames": studied.frames,
        "lenses": {
            "count": [layout.lens_rows, layout.lens_cols],
            "px_per_lens": layout.px_per_lens,
            "lattice": layout.lattice,
        },
        "chroma": wanted.chroma,
        "intra": wanted.intra,
        "points": [{name: _number(value) for name, value in asdict(point).items()} for point in studied.points],
        "bd_rate": [
            {"codec": codec, "arrangement": arrangement, "against_the_first": _number(saving)}
            for (codec, arrangement), saving in studied.bd_rates.items()
        ],
    }


def _number(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _video(folder: Path, fps: float) -> Sequence8:
    frames = find_frames(folder)
    paths = [frames[name] for name in sorted(frames)]
    layouts = {display_size(named_rig(path)) for path in paths}
    if len(layouts) > 1:
        raise BadInput(f"expected the same lenses over all frames, got {'; '.join(map(str, layouts))}")

    def read() -> Iterator[Codes]:
        for path in paths:
            with whole_picture(path):
                codes = picture_codes(path)
            yield codes

    return Sequence8(frames=read, count=len(paths), layout=layouts.pop(), fps=fps)


def _write_csv(path: Path, points: Sequence[Point]) -> None:
    with path.open("w", newline="") as file:
        rows = [asdict(point) for point in points]
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _plot(path: Path, studied: Studied, wanted: Wanted) -> None:
    note = f"{studied.layout}, {studied.frames} frames, {wanted.chroma}"
    note += ", every frame alone" if wanted.intra else ""
    with axes(
        title="Rate and distortion of an integral video",
        x="bits a pixel",
        y="PSNR Y, mean over the views, dB",
        note=note,
        files=(path,),
    ) as drawn:
        drawn.set_xscale("log")
        for axis in (drawn.xaxis.set_major_formatter, drawn.xaxis.set_minor_formatter):
            axis("{x:g}")
        for number, codec in enumerate(wanted.codecs):
            for arrangement in wanted.arrangements:
                curve = [point for point in studied.points if point.curve == (codec, arrangement)]
                drawn.plot(
                    [point.bits_per_px for point in curve],
                    [point.view_psnr_y_db for point in curve],
                    _MARKS[arrangement],
                    color=COLOURS[number % len(COLOURS)],
                    label=f"{codec}, {arrangement}",
                )
