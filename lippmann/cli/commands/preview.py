"""Previews of a job on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.options import JobFile, OutputFolder, Overrides, SceneToRender
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.local.preview import WrittenPreview


def preview(
    scene: SceneToRender = None,
    job_file: JobFile = None,
    frame: Annotated[
        int | None, typer.Option(min=1, max=999_999, help="The frame. The default is the first one of the job.")
    ] = None,
    max_lenses: Annotated[int, typer.Option(min=1, max=90, help="The largest number of lenses across and down.")] = 45,
    max_px_per_lens: Annotated[
        int, typer.Option(min=2, max=16, help="The largest number of pixels across a lens.")
    ] = 8,
    out: OutputFolder = Path("out"),
    overrides: Overrides = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="Render again whenever the job file or the scene changes, until Ctrl-C.")
    ] = False,
    *,
    output: Output,
) -> None:
    """Render one small frame on this machine, without a farm. It has the optics of the job and fewer lenses and pixels.

    It writes integral.png, the orthoscopic integral image, and view.png, the view in the middle.
    """
    from lippmann.local.preview import PreviewRequest, watch_previews, write_preview
    from lippmann.plan.preview import PreviewSize

    size = PreviewSize(max_lenses, max_px_per_lens)
    request = PreviewRequest(scene, job_file, overrides or (), frame, size, out)
    if not watch:
        _print(write_preview(request), output)
        return
    for made in watch_previews(request, lambda error: output.note(f"lippmann: {error.message}")):
        _print(made, output)


def _print(made: WrittenPreview, output: Output) -> None:
    for note in made.notes:
        output.note(f"note: {note}")
    times = made.times
    data = {
        "files": [str(made.integral), str(made.view)],
        "rig": made.rig.model_dump(),
        "notes": list(made.notes),
        "times": {name: round(value, 3) for name, value in times.model_dump().items()},
        "seconds": round(made.seconds, 3),
    }
    words = (
        f"{made.seconds:.2f} s; of the engine {times.render_s:.2f} s, with {times.start_s:.2f} s until the scene was "
        f"loaded; {times.cpu_s:.2f} s of CPU"
    )
    output.result(data, f"{made.integral}\n{made.view}\n{words}")
