"""The names of artifacts. A name is a function of the artifact's definition, so any order may arrive twice."""

from __future__ import annotations

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.outputs.output import OutputOptions
from lippmann.job.rendering.channels import stored_channels
from lippmann.job.spec import JobSpec

JOB_FILE = "job.json"
PLAN_FILE = "plan.json"

KIND = "kind"
"""The header attribute of an integral image that is `PSEUDOSCOPIC` or `ORTHOSCOPIC`, whatever the name of its file."""

PSEUDOSCOPIC = "pseudoscopic"
ORTHOSCOPIC = "orthoscopic"


def bundle_name(digest: str) -> str:
    """Return the name of a scene bundle's zip (not below a job)."""
    return f"scenes/{digest}.zip"


def job_artifact(job_id: str, name: str) -> str:
    """Return the full name of an artifact of a job."""
    return f"{job_id}/{name}"


def frame_stem(frame: int) -> str:
    """Return a frame number as it is written in names.

    >>> frame_stem(7)
    '0007'
    """
    return f"{frame:04d}"


def tile_stem(tile: TileIndex) -> str:
    """Return a tile as it is written in names.

    >>> tile_stem(TileIndex(row=0, col=3))
    '00-03'
    """
    return f"{tile.row:02d}-{tile.col:02d}"


def pov_name(frame: int, tile: TileIndex) -> str:
    """Return the name of the .pov text of a tile."""
    return f"pov/{frame_stem(frame)}/{tile_stem(tile)}.pov"


def tile_name(frame: int, tile: TileIndex) -> str:
    """Return the name of a rendered tile."""
    return f"tiles/{frame_stem(frame)}/{tile_stem(tile)}.exr"


def depth_tile_name(frame: int, tile: TileIndex) -> str:
    """Return the name of the depth of a tile, as captured."""
    return f"depth-tiles/{frame_stem(frame)}/{tile_stem(tile)}.exr"


def channel_tile_name(frame: int, tile: TileIndex) -> str:
    """Return the name of the other channels of a tile, as captured."""
    return f"channel-tiles/{frame_stem(frame)}/{tile_stem(tile)}.exr"


def integral_name(frame: int) -> str:
    """Return the name of a pseudoscopic integral image, as captured."""
    return f"integral/{frame_stem(frame)}.exr"


def orthoscopic_name(frame: int) -> str:
    """Return the name of an orthoscopic integral image."""
    return f"orthoscopic/{frame_stem(frame)}.exr"


def device_name(frame: int) -> str:
    """Return the name of an orthoscopic integral image on the pixels of the device that shows it."""
    return f"device/{frame_stem(frame)}.exr"


def views_name(frame: int) -> str:
    """Return the name of all views of a frame, laid out as a grid."""
    return f"views/{frame_stem(frame)}.exr"


def depth_name(frame: int) -> str:
    """Return the name of the depth of every pixel of an orthoscopic integral image."""
    return f"depth/{frame_stem(frame)}.exr"


def channels_name(frame: int) -> str:
    """Return the name of the other channels of every pixel of an orthoscopic integral image; see `job.channels`."""
    return f"channels/{frame_stem(frame)}.exr"


def thumb_name(frame: int) -> str:
    """Return the name of the thumbnail of a frame."""
    return f"thumbs/{frame_stem(frame)}.webp"


def tile_artifacts(spec: JobSpec, frame: int, tile: TileIndex) -> tuple[str, ...]:
    """Return the names of the artifacts of a render task; the tile itself is stored last."""
    depth = (depth_tile_name(frame, tile),) if spec.capture.depth else ()
    channels = (channel_tile_name(frame, tile),) if stored_channels(spec.capture) else ()
    return (*depth, *channels, tile_name(frame, tile))


def masters(spec: JobSpec, frame: int) -> tuple[str, ...]:
    """Return the names of the masters of a frame, which the assembly stores before the thumbnail."""
    names = [integral_name(frame), orthoscopic_name(frame), views_name(frame)]
    if spec.capture.depth:
        names.append(depth_name(frame))
    if stored_channels(spec.capture):
        names.append(channels_name(frame))
    if spec.rig.device is not None:
        names.append(device_name(frame))
    return tuple(names)


def output_folder(output: OutputOptions) -> str:
    """Return the folder of the files of an output."""
    return "video" if output.IS_VIDEO else f"exports/{output.name}"


def sidecar_name(output: OutputOptions) -> str:
    """Return the name of the sidecar of an output, a JSON file that describes it.

    >>> from lippmann.job.outputs.videos import ViewsVideo
    >>> sidecar_name(ViewsVideo())
    'video/views.mp4.json'
    """
    return f"{'video' if output.IS_VIDEO else 'exports'}/{output.file_name}.json"


def output_name(output: OutputOptions) -> str:
    """Return the name of the file that is stored last and marks an output as complete: the video, else the sidecar.

    >>> from lippmann.job.outputs.videos import ViewsVideo
    >>> output_name(ViewsVideo())
    'video/views.mp4'
    """
    return f"{output_folder(output)}/{output.file_name}" if output.IS_VIDEO else sidecar_name(output)


def log_name(kind: TaskKind, frame: int | None, tile: TileIndex | None, output: str | None, attempt_number: int) -> str:
    """Return the name of the log of one attempt.

    >>> log_name(TaskKind.RENDER, 1, TileIndex(row=0, col=3), None, 2)
    'log/render-0001-00-03/2.txt'
    """
    parts = [kind.value]
    if frame is not None:
        parts.append(frame_stem(frame))
    if tile is not None:
        parts.append(tile_stem(tile))
    if output is not None:
        parts.append(output)
    return f"log/{'-'.join(parts)}/{attempt_number}.txt"
