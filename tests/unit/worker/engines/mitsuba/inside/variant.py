"""The variant of Mitsuba with which the tests of the program run."""

from __future__ import annotations

import os

from worker.engines.mitsuba.surroundings import LLVM

TEST_VARIANT = "LIPPMANN_TEST_VARIANT"
"""The environment variable that names another one than that of processors; `tests/integration/test_mitsuba_gpu.py` sets
it on a machine with a GPU."""


def variant_of_tests() -> str:
    """Return the variant."""
    return os.environ.get(TEST_VARIANT, LLVM)
