"""Run a coding study of a folder of frames: numbers as CSV and JSON, curves as a plot."""

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
from lippmann.local.files.master import named_rig, whole_picture
from lippmann.local.files.writable import check_writable
from lippmann.local.studies.codec_rates import Arrangement, Codes, Encoder, Point, Sequence8, savings, study
from lippmann.local.studies.compare import find_frames
from lippmann.local.studies.plot import COLOURS, axes, check_plots
from lippmann.plan.sampling import display_size
from lippmann.terminal.progress import ProgressLine
from worker.untrusted import picture_codes

NAME = "coding-study"
_MARKS: dict[Arrangement, str] = {"sheets": "o-", "views": "s--"}


@dataclass(frozen=True)
class StudyOptions:
    """The codecs, arrangements and quantizers of a study."""

    codecs: tuple[Encoder, ...]
    arrangements: tuple[Arrangement, ...]
    qps: tuple[int, ...]
    chroma: Chroma
    intra: bool


@dataclass(frozen=True)
class StudyResult:
    """The points of a study, and the files that hold them."""

    points: tuple[Point, ...]
    bd_rates: dict[tuple[Encoder, Arrangement], float]
    frames: int
    layout: CellLayout
    files: tuple[Path, ...]


def run_study(folder: Path, options: StudyOptions, *, fps: float, out: Path) -> StudyResult:
    """Run a coding study, and write `coding-study.csv`, `.json` and `.png`.

    Parameters
    ----------
    folder
        A folder of orthoscopic frames.
    options
        What is tried.
    fps
        Frames a second.
    out
        The folder to write.

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
                codecs=options.codecs,
                arrangements=options.arrangements,
                qps=options.qps,
                chroma=options.chroma,
                intra=options.intra,
                on_progress=line.show,
            ):
                points.append(point)
    except OutputError as error:
        raise BadInput(error.message) from error
    files = tuple(out / f"{NAME}{suffix}" for suffix in (".csv", ".json", ".png"))
    result = StudyResult(tuple(points), savings(points), video.count, video.layout, files)
    _write_csv(files[0], points)
    files[1].write_text(json.dumps(study_data(result, options), indent=1) + "\n")
    _plot(files[2], result, options)
    return result


def study_data(result: StudyResult, options: StudyOptions) -> dict[str, Any]:
    """Return the result as JSON data; an infinite or unknown number is null.

    Parameters
    ----------
    result
        The result of `run_study`.
    options
        The options of the study.
    """
    layout = result.layout
    return {
        "frames": result.frames,
        "lenses": {
            "count": [layout.lens_rows, layout.lens_cols],
            "px_per_lens": layout.px_per_lens,
            "lattice": layout.lattice,
        },
        "chroma": options.chroma,
        "intra": options.intra,
        "points": [{name: _number(value) for name, value in asdict(point).items()} for point in result.points],
        "bd_rate": [
            {"codec": codec, "arrangement": arrangement, "against_the_first": _number(saving)}
            for (codec, arrangement), saving in result.bd_rates.items()
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


def _plot(path: Path, result: StudyResult, options: StudyOptions) -> None:
    note = f"{result.layout}, {result.frames} frames, {options.chroma}"
    note += ", every frame alone" if options.intra else ""
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
        for number, codec in enumerate(options.codecs):
            for arrangement in options.arrangements:
                curve = [point for point in result.points if point.curve == (codec, arrangement)]
                drawn.plot(
                    [point.bits_per_px for point in curve],
                    [point.view_psnr_y_db for point in curve],
                    _MARKS[arrangement],
                    color=COLOURS[number % len(COLOURS)],
                    label=f"{codec}, {arrangement}",
                )
