"""The engines that render scenes: which one a scene needs, and what each of them cannot do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

from lippmann.errors import FieldProblem
from lippmann.job.rendering.channels import CHANNEL_PARTS
from lippmann.job.rendering.render_settings import Channel, RenderSettings
from lippmann.job.rendering.workers import ENGINE_TITLES
from lippmann.job.spec import JobSpec

Engine = Literal["povray", "mitsuba"]
"""The name of an engine."""

POVRAY_FILES = (".pov", ".inc")
"""The suffixes of the scene files that POV-Ray reads; Mitsuba reads all others that a bundle may have."""

MITSUBA_FILES = (".xml", ".gltf", ".glb", ".obj", ".ply")
"""The suffixes of the scene files that Mitsuba reads."""

ENGINE_CHANNELS: Mapping[Engine, tuple[Channel, ...]] = {
    "povray": ("depth",),
    "mitsuba": ("depth", *CHANNEL_PARTS),
}
"""The channels that each engine renders beside the colours."""

_DEFAULTS = RenderSettings()


def engine_of_file(file: str) -> Engine:
    """Return the engine that reads a scene file.

    >>> engine_of_file("models/fish.glb")
    'mitsuba'
    >>> engine_of_file("Scene.INC")
    'povray'
    """
    return "povray" if file.lower().endswith(POVRAY_FILES) else "mitsuba"


def engine_problems(spec: JobSpec, file: str) -> Iterator[FieldProblem]:
    """Yield the fields of a job that ask for what the engine of its scene cannot do.

    Parameters
    ----------
    spec
        The job at a frame.
    file
        The scene file of its bundle.
    """
    engine = engine_of_file(file)
    if spec.render.engine not in ("auto", engine):
        expected = f"auto or {engine}, because {file} is a scene of {ENGINE_TITLES[engine]}"
        yield FieldProblem(field="render.engine", expected=expected, got=spec.render.engine)
        return
    yield from _no_such_channels(spec, engine)
    yield from _not_with_povray(spec) if engine == "povray" else _not_with_mitsuba(spec)


def _no_such_channels(spec: JobSpec, engine: Engine) -> Iterator[FieldProblem]:
    """Yield the channels that an engine does not render."""
    known = ENGINE_CHANNELS[engine]
    others = [channel for channel in spec.capture.channels if channel not in known]
    if others:
        some = "depth alone" if known == ("depth",) else f"some of {', '.join(known)}"
        expected = f"{some} with {ENGINE_TITLES[engine]}"
        yield FieldProblem(field="capture.channels", expected=expected, got=", ".join(others))


def _not_with_povray(spec: JobSpec) -> Iterator[FieldProblem]:
    render = spec.render
    if render.samples != 1:
        expected = "1 with POV-Ray, which traces one ray a pixel: capture.supersample is for it"
        yield FieldProblem(field="render.samples", expected=expected, got=str(render.samples))
    if render.path_depth != _DEFAULTS.path_depth:
        expected = f"{_DEFAULTS.path_depth}, its default, with POV-Ray: max_trace_level of the scene is for it"
        yield FieldProblem(field="render.path_depth", expected=expected, got=str(render.path_depth))
    if render.clamp is not None:
        yield FieldProblem(field="render.clamp", expected="null with POV-Ray", got=f"{render.clamp:g}")


def _not_with_mitsuba(spec: JobSpec) -> Iterator[FieldProblem]:
    if spec.capture.method == "glass":
        expected = "auto or ray_camera with Mitsuba, whose rays come from the exact trace"
        yield FieldProblem(field="capture.method", expected=expected, got="glass")
    if spec.render.antialias != "off":
        expected = "off with Mitsuba: render.samples places several rays inside each pixel"
        yield FieldProblem(field="render.antialias", expected=expected, got="on")
    if spec.stage.follow_camera:
        yield FieldProblem(field="stage.follow_camera", expected="false with Mitsuba", got="true")
