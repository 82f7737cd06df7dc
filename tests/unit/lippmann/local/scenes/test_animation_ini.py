"""The .ini of an animation: which one belongs to a scene, and what of it a scene.toml has."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.job.animation.clock import Clock
from lippmann.local.scenes.animation_ini import animation_ini

WINDOWS = (
    '; by hand\r\nInput_File_Name="C:\\scenes\\ORBIT.POV"\r\nInitial_Frame=0\r\nFinal_Frame=59 ; a turn\r\n'
    'Final_Clock=10\r\nCyclic_Animation=On\r\nLibrary_Path=.\\models\r\nLibrary_Path="C:\\POV-Ray\\include"\r\n'
    "Library_Path=..\\elsewhere\r\nDeclare=Turn=3\r\n+W640 +H480\r\n[low]\r\nFinal_Frame=3\r\n"
)


def read(folder: Path, **files: str) -> Path:
    """Write .ini files, and return the scene beside them."""
    (folder / "models").mkdir()
    (folder / "orbit.pov").write_text("")
    for name, text in files.items():
        (folder / f"{name}.INI").write_bytes(text.encode("latin-1"))
    return folder / "orbit.pov"


def test_the_options_of_the_ini_that_starts_a_scene_are_read(tmp_path: Path) -> None:
    ini = animation_ini(read(tmp_path, run=WINDOWS, orbit="Final_Frame=7"))
    assert ini is not None
    assert (ini.name, ini.clock) == ("run.INI", {"first": 0.0, "last": 10.0, "frames": 60, "cyclic": True})
    assert ini.include == ("models",)
    assert len(ini.notes) == 3
    for note, text in zip(ini.notes, ("frame 0 of run.INI", "elsewhere", "Turn=3"), strict=True):
        assert text in note
    assert Clock.model_validate(ini.clock).at(60) == pytest.approx(10 * 59 / 60)


@pytest.mark.parametrize(
    ("text", "clock"),
    [
        ("+KFI1 +KFF30 +KI0.5 +KF2 +KC", {"first": 0.5, "last": 2.0, "frames": 30, "cyclic": True}),
        ("Final_Frame=30", {"first": 0.0, "last": 1.0, "frames": 30, "cyclic": False}),
        ("Clock=0.3\n+A0.3", {"first": 0.3}),
        ("+W640 +K0.5 +A0.3", {"first": 0.5}),
        ("+KFF30 +O/tmp/x-ki2 -KC", {"first": 0.0, "last": 1.0, "frames": 30, "cyclic": False}),
        ('+KFF2 +O"a +KFF9 -KI3.png"', {"first": 0.0, "last": 1.0, "frames": 2, "cyclic": False}),
        ("Width=640", {}),
        ("Final_Frame=1\nFinal_Clock=4", {}),
        ("Final_Frame=many\nFinal_Clock=nan\nInitial_Frame=1e99\n=\n\xff[\n", {}),
    ],
)
def test_an_ini_of_the_same_name_is_read_with_options_or_switches(
    tmp_path: Path, text: str, clock: dict[str, object]
) -> None:
    ini = animation_ini(read(tmp_path, Orbit=text))
    assert ini is not None
    assert ini.clock == clock


def test_the_name_of_a_picture_is_no_switch(tmp_path: Path) -> None:
    ini = animation_ini(read(tmp_path, orbit='+Oout-i.png\n+Oimg-light.png\n+L"models" +KFF9'))
    assert ini is not None
    assert (ini.include, ini.notes, ini.clock["frames"]) == (("models",), (), 9)


def test_an_ini_that_starts_another_scene_does_not_count(tmp_path: Path) -> None:
    assert animation_ini(read(tmp_path, Orbit="Input_File_Name=other.pov\nFinal_Frame=9", more="Final_Frame=9")) is None
