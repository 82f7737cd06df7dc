"""Which master a command looks at."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.local.files.open_master import open_master

NOWHERE = Connection(url=None, key=None, data_dir=Path("nowhere"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "orthoscopic").mkdir()
    for frame in (3, 12):
        (tmp_path / f"orthoscopic/{frame:04d}.exr").touch()
    return tmp_path


def test_a_file_is_lent_as_it_is_and_a_folder_lends_its_first_frame_or_the_one_asked_for(folder: Path) -> None:
    file = folder / "orthoscopic/0012.exr"
    for source, frame, expected in ((file, None, file), (folder, None, "0003"), (folder, 12, "0012")):
        with open_master(source, frame=frame, connection=NOWHERE) as master:
            assert master == expected or master.stem == expected


def test_what_is_not_there_is_named(folder: Path) -> None:
    for source, frame, words in (
        (folder, 4, "--frame: expected a frame of .*, got 4"),
        (folder / "orthoscopic/0003.exr", 3, "expected --frame with a job or a folder"),
        (folder / "orthoscopic", None, "expected masters in"),
    ):
        with pytest.raises(BadInput, match=words), open_master(source, frame=frame, connection=NOWHERE):
            pass
