"""A picture is seen by one reader of OpenImageIO, the one for its content; no other of its readers is tried."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenImageIO
import pytest
from PIL import Image

from lippmann.errors import ArtifactBroken
from worker.images import read
from worker.images.foreign import decoder


@pytest.fixture
def disguised(tmp_path: Path) -> Path:
    """Return a GIF with the name of a PNG, which a header check would have taken for one."""
    path = tmp_path / decoder.NAMES["PNG"]
    Image.fromarray(np.zeros((9, 7), np.uint8)).save(path, "gif")
    return path


@pytest.mark.promise("Scenes", "Of the readers of OpenImageIO, one sees a picture of a stranger: that of its content.")
def test_the_decoder_tries_one_reader(disguised: Path) -> None:
    shutil.copyfile(decoder.__file__, disguised.parent / "decoder.py")
    line = [sys.executable, "-I", "-B", "decoder.py", disguised.name, "0", "9", "7"]
    ran = subprocess.run(line, cwd=disguised.parent, capture_output=True, text=True, check=False)
    assert ran.returncode == decoder.REFUSED, ran.stdout + ran.stderr
    assert not (disguised.parent / decoder.PIXELS).exists()


def test_the_worker_tries_one_reader(disguised: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    OpenImageIO.attribute("try_all_readers", 1)
    monkeypatch.setattr(read, "read_header", lambda path: SimpleNamespace(format="PNG"))
    with pytest.raises(ArtifactBroken), read.opened(disguised):
        pass
