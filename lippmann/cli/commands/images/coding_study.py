"""Rate and distortion of an integral video through several codecs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

import typer

from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.terminal.output import Output
from lippmann.terminal.table import table

if TYPE_CHECKING:
    from lippmann.local.studies.coding_study import StudyResult

Name = TypeVar("Name", bound=str)


def coding_study(
    source: Annotated[str, typer.Argument(metavar="JOB", help="The id of a job, or a folder of orthoscopic masters.")],
    codecs: Annotated[
        str, typer.Option(help="The codecs, separated by commas: x264, x265, svtav1, vp9.")
    ] = "x264,x265,svtav1",
    qp: Annotated[str, typer.Option(help="The quantization parameters, separated by commas.")] = "22,27,32,37",
    arrange: Annotated[
        str,
        typer.Option(help="The arrangements to code, separated by commas: sheets (whole integral images) and views."),
    ] = "sheets,views",
    chroma: Annotated[Literal["4:2:0", "4:4:4"], typer.Option(help="The chroma subsampling.")] = "4:2:0",
    intra: Annotated[bool, typer.Option("--intra", help="Code every frame independently.")] = False,
    fps: Annotated[
        float,
        typer.Option(min=0.001, help="The frames per second of a folder of masters. A job has its own frame rate."),
    ] = 8.0,
    out: Annotated[Path, typer.Option(help="The folder to write to.")] = Path("out/coding-study"),
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Measure what codecs preserve of an integral video. It is coded with several codecs and quantizers."""
    from lippmann.local.files.job_masters import job_masters
    from lippmann.local.studies.codec_rates import ARRANGEMENTS, ENCODERS
    from lippmann.local.studies.coding_study import StudyOptions, run_study, study_data

    wanted = StudyOptions(
        codecs=_chosen("--codecs", codecs, tuple(ENCODERS)),
        arrangements=_chosen("--arrange", arrange, ARRANGEMENTS),
        qps=_quantizers(qp),
        chroma=chroma,
        intra=intra,
    )
    if Path(source).is_dir():
        studied = run_study(Path(source), wanted, fps=fps, out=out)
    else:
        with connection.client() as client:
            job = client.job(source)
            with job_masters(client, job, job.spec.frame_numbers) as folder:
                studied = run_study(folder, wanted, fps=job.fps, out=out)
    data = study_data(studied, wanted) | {"files": [str(path) for path in studied.files]}
    output.result(data, _text(studied))


def _chosen(option: str, text: str, known: tuple[Name, ...]) -> tuple[Name, ...]:
    names = [name.strip() for name in text.split(",")]
    if not set(names) <= set(known) or len(set(names)) < len(names):
        raise BadInput(
            f"{option}: expected some of {', '.join(known)}, each at most once and separated by commas, got {text}"
        )
    return tuple(name for name in known if name in names)


def _quantizers(text: str) -> tuple[int, ...]:
    try:
        numbers = sorted({int(number) for number in text.split(",")})
    except ValueError as error:
        raise BadInput(f"--qp: expected whole numbers separated by commas, got {text}") from error
    return tuple(numbers)


def _text(studied: StudyResult) -> str:
    rows = [
        (
            point.codec, point.arrangement, point.qp, f"{point.bits_per_px:.4f}", f"{point.kbit_s:.0f}",
            f"{point.psnr_y_db:.2f} dB", f"{point.view_psnr_y_db:.2f} dB", f"{point.view_psnr_y_min_db:.2f} dB",
            f"{point.view_ssim:.4f}",
        )
        for point in studied.points
    ]  # fmt: skip
    head = ("codec", "coded as", "qp", "bits/px", "kbit/s", "psnr y", "views", "worst view", "views ssim")
    savings = [
        (codec, arrangement, "-" if saving != saving else f"{saving:+.1%}")
        for (codec, arrangement), saving in studied.bd_rates.items()
    ]
    first = studied.points[0]
    return "\n".join(
        [
            f"{studied.layout}, {studied.frames} frames",
            "",
            table(head, rows),
            "",
            f"Rate at the same PSNR Y of the views, relative to {first.codec} as {first.arrangement} (Bjøntegaard):",
            table(("codec", "coded as", "rate"), savings),
            "",
            *(str(path) for path in studied.files),
        ]
    )
