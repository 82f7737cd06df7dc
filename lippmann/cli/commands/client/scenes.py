"""Scenes: list, show, prepare, upload and remove them, and capture one frame without a farm."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import JobFile, OutputFolder, Overrides, SceneToRender, with_context
from lippmann.cli.several import act_on_each
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

app = typer.Typer(help="List, show, prepare, upload and remove scenes.", no_args_is_help=True)


@app.command("list")
@with_context
def list_scenes(output: Output, connection: Connection) -> None:
    """List the scenes of the service."""
    from lippmann.cli.text.jobs import scene_table

    with connection.client() as client:
        found = list(client.scenes())
    output.result([scene.model_dump(mode="json") for scene in found], scene_table(found))


@app.command()
@with_context
def show(
    name: Annotated[str, typer.Argument(help="The name of the scene.")], output: Output, connection: Connection
) -> None:
    """Show a scene and its parameters."""
    from lippmann.cli.text.jobs import scene_text

    with connection.client() as client:
        scene = client.scene(name)
    output.result(scene.model_dump(mode="json"), scene_text(scene))


@app.command()
@with_context
def upload(
    bundle: Annotated[
        Path, typer.Argument(metavar="BUNDLE", help="A folder or zip with scene.toml and the files of the scene.")
    ],
    name: Annotated[
        str | None, typer.Option(help="The name of the scene in jobs. The default is the name of the folder or zip.")
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Upload a scene to the service."""
    from lippmann.local.files.bundle import read_bundle

    data = read_bundle(bundle)
    with connection.client() as client:
        scene = client.upload_scene(_name_of(bundle) if name is None else name, data)
    for note in scene.notes:
        output.note(f"note: {note}")
    output.result(scene.model_dump(mode="json"), f"The scene {scene.name} is uploaded ({scene.digest[:12]}).")


def _name_of(bundle: Path) -> str:
    """Return the name of a folder, or that of a zip without its ending."""
    path = bundle.resolve()
    return path.name if path.is_dir() else path.stem


@app.command("rm")
@with_context
def remove(
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="The names of one or more uploaded scenes.")],
    output: Output,
    connection: Connection,
) -> None:
    """Remove uploaded scenes from the service. Jobs that were submitted with them keep them."""
    with connection.client() as client:

        def delete(name: str) -> tuple[object, str]:
            client.remove_scene(name)
            return {"name": name, "removed": True}, f"The scene {name} is removed."

        act_on_each(names, delete, output)


@app.command()
@with_context
def init(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="The .pov file of a scene with a camera, a .glb or .gltf, or a .ply of splats."
        ),
    ],
    *,
    output: Output,
) -> None:
    """Write a scene.toml for a .pov file, a glTF model or Gaussian splats.

    It lies beside the file and gives its reasons as comments.
    """
    from lippmann.local.scenes.scene_init import init_scene

    made = init_scene(file)
    for note in made.notes:
        output.note(f"note: {note}")
    data = {"file": str(made.file), "notes": list(made.notes)}
    output.result(data, f"{made.file} is written. `lippmann capture {file.parent}` shows a frame.")


def capture(
    scene: SceneToRender = None,
    job_file: JobFile = None,
    frame: Annotated[int, typer.Option(min=1, max=999_999, help="The frame to render.")] = 1,
    out: OutputFolder = Path("out"),
    overrides: Overrides = None,
    *,
    output: Output,
) -> None:
    """Render one frame on this machine, without a farm. The pixels are those of a farm."""
    from lippmann.local.capture import capture

    captured = capture(scene, job_file, overrides or (), frame=frame, out=out)
    for note in captured.notes:
        output.note(f"note: {note}")
    files = [str(path) for path in captured.files]
    data = {"frame": frame, "files": files, "notes": list(captured.notes), "seconds": round(captured.seconds, 2)}
    output.result(data, "\n".join(files))
