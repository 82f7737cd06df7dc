"""Masters on disk as the frames that outputs are made from: one file, or a folder as `capture` writes it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from lippmann.errors import ArtifactMissing, BadInput
from lippmann.job.animation.frames import parse_frames
from lippmann.job.optics.rig import Rig
from lippmann.job.rendering.channels import channels_in
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import Display
from lippmann.local.files.master import (
    ORTHOSCOPIC,
    OTHER_MASTERS,
    channels_beside,
    depth_beside,
    named_rig,
    stage_in,
)
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from worker.images.read import read_attributes
from worker.tasks.outputs.frame_source import FrameSource, MasterReader
from worker.untrusted import decoded_rows, read_depth_numbers, read_master_light

FACTS = ("job", "scene", "bundle")
"""The attributes of a header that state the origin of a master."""


SANDBOXED = MasterReader(read_master_light, partial(decoded_rows, is_master=True), read_depth_numbers)
"""The reader of masters that anybody may have made."""


@dataclass(frozen=True)
class _Master:
    path: Path
    rig: Rig
    stage: Stage | None


def files_frames(source: Path, *, frames: str | None = None, fps: float, display: Display | None = None) -> FrameSource:
    """Return the frame source of orthoscopic masters on disk.

    Parameters
    ----------
    source
        A master, or a folder of them, or one with such a folder `orthoscopic/`.
    frames
        The frames to use, as in a job file; all by default.
    fps
        Frames per second; masters do not have a rate.
    display
        The display; None for the default of a job.

    Raises
    ------
    BadInput
        If there are no masters, one is no picture or names no rig, their lenses differ, or a frame is missing.
    """
    found = {number: _master(path) for number, path in _numbered(source).items()}
    if frames is not None:
        wanted = parse_frames(frames)
        missing = [number for number in wanted if number not in found]
        if missing:
            raise BadInput(f"--frames: expected some of {_listed(found)} in {source}, got {_listed(missing)}")
        found = {number: found[number] for number in wanted}
    layouts = {display_size(master.rig): master.path for master in found.values()}
    if len(layouts) > 1:
        listed = "; ".join(f"{layout} in {path}" for layout, path in layouts.items())
        raise BadInput(f"expected the same lenses over all frames, got {listed}")
    first = next(iter(found.values()))
    attributes = read_attributes(first.path)
    paths = {names.orthoscopic_name(number): master.path for number, master in found.items()}
    depths = {names.depth_name(number): depth_beside(master.path) for number, master in found.items()}

    others = {names.channels_name(number): channels_beside(master.path) for number, master in found.items()}

    @contextmanager
    def local_path(name: str) -> Iterator[Path]:
        path = (paths | depths | others).get(name)
        if path is None or not path.is_file():
            raise ArtifactMissing(f"there is no {name} in {source}")
        yield path

    return FrameSource(
        frames=tuple(found),
        fps=fps,
        layout=next(iter(layouts)),
        rig=lambda frame: found[frame].rig,
        display=display or Display(),
        facts={name: attributes.get(name, "") for name in FACTS},
        master=local_path,
        stage=lambda frame: found[frame].stage,
        has_depth=all(path.is_file() for path in depths.values()),
        channels=_common_channels(others.values()),
        reader=SANDBOXED,
    )


def _numbered(source: Path) -> dict[int, Path]:
    if source.is_file():
        paths = [source]
    else:
        inside = source / ORTHOSCOPIC if (source / ORTHOSCOPIC).is_dir() else source
        paths = sorted(inside.glob("*.exr")) if inside.is_dir() else []
    if not paths:
        raise BadInput(f"expected orthoscopic masters (EXR) in {source}, got none")
    if paths[0].absolute().parent.name in OTHER_MASTERS:
        raise BadInput(f"expected orthoscopic masters, as {ORTHOSCOPIC}/{paths[0].name}, got {paths[0]}")
    known = {int(path.stem): path for path in paths if path.stem.isdecimal() and int(path.stem) > 0}
    if len(known) < len(paths):  # files of other names: in their order
        known = dict(enumerate(paths, start=1))
    return dict(sorted(known.items()))


def _common_channels(files: Iterable[Path]) -> tuple[Channel, ...]:
    """Return the channels that all files have, by their headers; none if a file is missing."""
    named = [channels_in(read_attributes(path)) if path.is_file() else () for path in files]
    return tuple(channel for channel in named[0] if all(channel in others for others in named))


def _master(path: Path) -> _Master:
    return _Master(path=path, rig=named_rig(path), stage=stage_in(path))


def _listed(numbers: Iterable[int]) -> str:
    listed = [str(number) for number in numbers]
    return ", ".join(listed) if len(listed) <= 8 else f"{listed[0]} to {listed[-1]}"
