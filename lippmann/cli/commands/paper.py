"""The experiments of the paper, one command for each figure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import OutputFolder, with_context
from lippmann.terminal.output import Output

app = typer.Typer(
    help="Repeat the experiments of Athineos et al. 2006. Each command writes a figure and its numbers.",
    no_args_is_help=True,
)

Quick = Annotated[
    bool, typer.Option("--quick", help="Use a small version that takes seconds instead of the paper's settings.")
]

Camera = Annotated[
    Literal["orthographic", "pinhole"],
    typer.Option(help="The camera behind the array: orthographic (telecentric), or the pinhole camera of the paper."),
]

FIGURES = {
    "fig3": "Make a sample capture with the square array. A part is enlarged.",
    "fig4": "Make a sample capture with the hexagonal array. A part is enlarged.",
    "fig5": "Show the scene and its image behind the imaging lens.",
    "fig7": "Capture with four positions of the array, and measure the depths.",
    "fig8": "Measure rendering time against pixels per lens.",
    "fig9": "Measure rendering time against the antialiasing threshold.",
    "fig10": "Make two successive frames of an integral video.",
    "fig11": "Make the 16 views of these frames, and the video of all views.",
}


def _command(name: str) -> Callable[..., None]:
    def figure(
        out: OutputFolder = Path("out/paper"), quick: Quick = False, camera: Camera = "orthographic", *, output: Output
    ) -> None:
        _make(name, out, quick, camera, output)

    def figure_without_array(out: OutputFolder = Path("out/paper"), quick: Quick = False, *, output: Output) -> None:
        _make(name, out, quick, "pinhole", output)

    return with_context(figure_without_array if name == "fig5" else figure)


for _name, _help in FIGURES.items():
    app.command(_name, help=_help)(_command(_name))


def _make(name: str, out: Path, quick: bool, camera: Literal["orthographic", "pinhole"], output: Output) -> None:
    from lippmann.experiments.run import run_figure

    figure = run_figure(name, out=out, quick=quick, camera=camera)
    files = [str(file) for file in (*figure.made.files, figure.numbers)]
    output.result({**figure.data, "files": files}, "\n".join([figure.made.text, "", *files]))
