"""Scenes: list, show, upload."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir, Key, Url
from lippmann.client.connection import Connection
from lippmann.terminal.output import Talk

app = typer.Typer(help="Scenes that jobs can ask for.", no_args_is_help=True)


@app.command("list")
def list_scenes(as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR) -> None:
    """List the scenes that jobs can ask for."""
    from lippmann.cli.text.jobs import scene_table

    with Connection(url, key, data_dir).client() as client:
        found = list(client.scenes())
    Talk(as_json).result([scene.model_dump(mode="json") for scene in found], scene_table(found))


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="The scene's name.")],
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Show a scene and its parameters."""
    from lippmann.cli.text.jobs import scene_text

    with Connection(url, key, data_dir).client() as client:
        scene = client.scene(name)
    Talk(as_json).result(scene.model_dump(mode="json"), scene_text(scene))


@app.command()
def upload(
    bundle: Annotated[
        Path, typer.Argument(metavar="BUNDLE", help="A folder or zip with scene.toml and the scene it names.")
    ],
    name: Annotated[str | None, typer.Option(help="Its name for jobs; else that of the folder.")] = None,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Give the service a scene of your own."""
    from lippmann.local.files.bundle import read_bundle

    data = read_bundle(bundle)
    with Connection(url, key, data_dir).client() as client:
        scene = client.upload_scene(name or bundle.resolve().stem, data)
    Talk(as_json).result(scene.model_dump(mode="json"), f"{scene.name} is there ({scene.digest[:12]})")
