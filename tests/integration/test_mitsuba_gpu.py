"""Mitsuba on a GPU of NVIDIA: the exact optics, and a worker that renders in its sandbox."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.builders import small_job
from tests.repository import ROOT
from tests.unit.worker.engines.mitsuba.inside.variant import TEST_VARIANT
from tests.without_farm import masters_without_farm
from worker.engines.mitsuba.surroundings import CUDA
from worker.engines.mitsuba.version import Found, mitsuba_version
from worker.sandbox.devices import nvidia_devices

pytestmark = pytest.mark.skipif(
    nvidia_devices() is None, reason="needs a GPU of NVIDIA: nothing of cuda_ad_rgb is tried on this machine"
)

OF_THE_OPTICS = ("test_arrays.py", "test_shade.py", "test_own_scenes.py")
"""The tests of the program whose results do not depend on the variant: hits and depths against the exact trace, tiles,
threads and repeats."""


@pytest.fixture
def on_gpu(monkeypatch: pytest.MonkeyPatch) -> Iterator[Found]:
    """Let this process render on the GPU alone."""
    monkeypatch.setenv("LIPPMANN_MITSUBA", CUDA)
    mitsuba_version.cache_clear()
    found = mitsuba_version()
    assert isinstance(found, Found), found.reason
    yield found
    mitsuba_version.cache_clear()


def test_the_optics_are_as_exact_as_on_a_processor() -> None:
    folder = "tests/unit/worker/engines/mitsuba/inside"
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        *(f"{folder}/{f}" for f in OF_THE_OPTICS),
    ]
    ran = subprocess.run(command, cwd=ROOT, env=os.environ | {TEST_VARIANT: CUDA}, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-5000:]


def test_a_worker_renders_in_its_sandbox_and_tiles_are_the_whole_frame(tmp_path: Path, on_gpu: Found) -> None:
    assert on_gpu.variant == CUDA
    whole, cut = (
        masters_without_farm(tmp_path / name, small_job("fish-mesh", tiles=tiles, capture={"depth": True}))[1]
        for name, tiles in (("whole", [1, 1]), ("cut", [2, 2]))
    )
    assert len(np.unique(whole)) > 100
    np.testing.assert_array_equal(cut, whole)
