"""What some tests need of the machine: missing, it skips them at home and fails in continuous integration."""

from __future__ import annotations

import os
import shutil

import pytest

needs_ffprobe = pytest.mark.skipif(
    shutil.which("ffprobe") is None and "CI" not in os.environ, reason="needs ffprobe (it is there in CI)"
)
