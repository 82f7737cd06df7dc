"""The paper's experiments, one command a figure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import AsJson
from lippmann.terminal.output import Talk

app = typer.Typer(
    help="The experiments of Athineos et al. 2006, made and measured here: each a picture and its numbers.",
    no_args_is_help=True,
)

Out = Annotated[Path, typer.Option(help="The folder to write to.")]
Quick = Annotated[bool, typer.Option("--quick", help="Small, in seconds, in place of the paper's settings.")]

FIGURES = {
    "fig3": "Make a sample capture with the square array, and part of it enlarged.",
    "fig4": "Make a sample capture with the hexagonal array, and part of it enlarged.",
    "fig5": "Show the scene, and its image behind the imaging lens.",
    "fig7": "Capture with four positions of the array, from real to virtual, and measure the depths.",
    "fig8": "Measure rendering time against pixels per lens.",
    "fig9": "Measure rendering time against the antialiasing threshold, with both sampling methods.",
    "fig10": "Make two successive frames of an integral video.",
    "fig11": "Make the 16 views of these frames, and the movie of all views.",
}


def _command(name: str) -> Callable[..., None]:
    def figure(out: Out = Path("out/paper"), quick: Quick = False, as_json: AsJson = False) -> None:
        _make(name, out, quick, as_json)

    return figure


for _name, _help in FIGURES.items():
    app.command(_name, help=_help)(_command(_name))


def _make(name: str, out: Path, quick: bool, as_json: bool) -> None:
    from lippmann.experiments.run import run_figure

    talk = Talk(as_json)
    figure = run_figure(name, out=out, quick=quick)
    files = [str(file) for file in (*figure.made.files, figure.numbers)]
    talk.result({**figure.data, "files": files}, "\n".join([figure.made.text, "", *files]))
