"""A scene of which one frame cannot be rendered, however often it is tried."""

from __future__ import annotations

from pathlib import Path

from worker.sandbox.bundle import pack_folder

_MANIFEST = """
title = "A ball that fails"
file = "ball.pov"

[stage]
location = [0, 0, -10]
look_at = [0, 0, 0]
near_mm = 5
far_mm = 20

[clock]
first = 1.0
per_frame = 1.0
"""
_SCENE = """
#version 3.7;
#if (abs(clock - {frame}) < 0.5) #error "the ball cannot be at {frame}" #end
light_source {{ <5, 5, -20>, rgb 1 }}
sphere {{ <0, 0, 0>, 3 pigment {{ rgb <1, 0.5, 0> }} }}
"""


def scene_without_frame(frame: int, folder: Path) -> bytes:
    """Return the bundle of a scene whose frames can be rendered except one."""
    folder.mkdir()
    (folder / "scene.toml").write_text(_MANIFEST)
    (folder / "ball.pov").write_text(_SCENE.format(frame=frame))
    return pack_folder(folder)
