"""The paper's experiments, one command a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.commands.options import AsJson
from lippmann.talk import Talk

app = typer.Typer(
    help="The experiments of Athineos et al. 2006, made and measured here: each a picture and its numbers.",
    no_args_is_help=True,
)

Out = Annotated[Path, typer.Option(help="The folder to write to.")]
Quick = Annotated[bool, typer.Option("--quick", help="Small, in seconds, in place of the paper's settings.")]

OUT = Path("out/paper")


@app.command()
def fig3(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Make a sample capture with the square array, and part of it enlarged."""
    _make("fig3", out, quick, as_json)


@app.command()
def fig4(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Make a sample capture with the hexagonal array, and part of it enlarged."""
    _make("fig4", out, quick, as_json)


@app.command()
def fig5(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Show the scene, and its image behind the imaging lens."""
    _make("fig5", out, quick, as_json)


@app.command()
def fig7(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Capture with four positions of the array, from real to virtual, and measure the depths."""
    _make("fig7", out, quick, as_json)


@app.command()
def fig8(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Measure rendering time against pixels per lens."""
    _make("fig8", out, quick, as_json)


@app.command()
def fig9(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Measure rendering time against the antialiasing threshold, with both sampling methods."""
    _make("fig9", out, quick, as_json)


@app.command()
def fig10(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Make two successive frames of an integral video."""
    _make("fig10", out, quick, as_json)


@app.command()
def fig11(out: Out = OUT, quick: Quick = False, as_json: AsJson = False) -> None:
    """Make the 16 views of these frames, and the movie of all views."""
    _make("fig11", out, quick, as_json)


def _make(name: str, out: Path, quick: bool, as_json: bool) -> None:
    from lippmann.paper.run import run_figure

    talk = Talk(as_json)
    figure = run_figure(name, out=out, quick=quick)
    files = [str(file) for file in (*figure.made.files, figure.numbers)]
    talk.result({**figure.data, "files": files}, "\n".join([figure.made.text, "", *files]))
