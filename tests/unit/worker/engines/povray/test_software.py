"""The software of a render: an upgrade of any part is noticed while the worker runs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from lippmann.errors import PovrayMissing
from worker.engines.povray import software as module
from worker.engines.povray.software import render_software


def program(folder: Path, said: str) -> str:
    path = folder / "povray"
    fresh = folder / "fresh"
    fresh.write_text(f"#!/bin/sh\necho 'POV-Ray {said}'\n")
    fresh.chmod(0o755)
    fresh.replace(path)
    return str(path)


def test_an_upgrade_of_povray_is_noticed(tmp_path: Path) -> None:
    first = render_software(program(tmp_path, "3.7.0.8"))
    assert (first.engine, first.engine_version) == ("povray", "3.7.0.8")
    assert render_software(program(tmp_path, "3.7.0.10")).engine_version == "3.7.0.10"


@pytest.mark.parametrize("name", ["INCLUDE_FOLDER", "RIGS_FOLDER"])
def test_a_change_of_a_template_is_noticed(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    povray, path = program(tmp_path, "3.7"), tmp_path / "include/lippmann/glass.inc"
    path.parent.mkdir(parents=True)
    path.write_text("#declare A = 1;")
    monkeypatch.setattr(module, name, tmp_path / "include")
    found = [render_software(povray).templates, render_software(povray).templates]
    path.write_text("#declare A = 2;")
    found.append(render_software(povray).templates)
    path.rename(path.with_name("renamed.inc"))
    found.append(render_software(povray).templates)
    assert found[0] == found[1]
    assert len(set(found)) == 3


def test_an_upgrade_of_the_include_folder_is_noticed_by_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "colors.inc").write_text("#declare Red = 1;")
    monkeypatch.setattr(module, "SYSTEM_INCLUDE", tmp_path)
    (tmp_path / "bin").mkdir()
    povray = program(tmp_path / "bin", "3.7")
    module._includes.cache_clear()
    was = render_software(povray).engine_includes
    (tmp_path / "colors.inc").write_text("#declare Red = 2;")
    os.utime(tmp_path, ns=(1, 1))
    assert render_software(povray).engine_includes != was
    module._includes.cache_clear()


def test_a_program_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(PovrayMissing):
        render_software(str(tmp_path / "none"))
