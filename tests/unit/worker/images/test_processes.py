"""OpenImageIO's threads: how many, and what a fork does to them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import OpenImageIO
import pytest

from worker.images.read import limit_threads

FORKED = """
import os, sys, tempfile, pathlib
import numpy as np
from worker.images import colour, convert, encode, read, resize, write
if (child := os.fork()) == 0:
    read.limit_threads(1)
    path = pathlib.Path(tempfile.mkdtemp()) / "a.exr"
    write.write_exr(path, np.zeros((64, 64, 3), np.float16), attributes={})
    os._exit(0 if convert.png(path) and resize.resize(np.ones((8, 8, 3)), rows=4, cols=4).any() else 1)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.fixture
def threads_put_back() -> Iterator[None]:
    yield
    OpenImageIO.attribute("threads", 0)
    OpenImageIO.attribute("exr_threads", 0)


def test_importing_all_of_it_leaves_a_forked_child_able_to_work() -> None:
    subprocess.run([sys.executable, "-c", FORKED], check=True, timeout=60)


@pytest.mark.usefixtures("threads_put_back")
@pytest.mark.parametrize(("count", "exr"), [(1, -1), (2, 2)])
def test_threads_are_limited(count: int, exr: int) -> None:
    limit_threads(count)
    assert OpenImageIO.get_int_attribute("threads") == count
    assert OpenImageIO.get_int_attribute("exr_threads") == exr


def test_no_threads_at_all_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one thread, got 0"):
        limit_threads(0)
