"""What all tests share."""

from __future__ import annotations

import os

from hypothesis import settings

from tests.ctrl_c import heed_ctrl_c
from tests.leftovers import watch_this_run

# No test is timed: these machines are noisy, and the first example may import a library. In continuous integration the
# examples are the same every time, so that what lands is what was tried; at home they are new ones.
settings.register_profile("lippmann", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("lippmann")

# A worker that looks for Mitsuba starts a child that costs seconds; the tests of Mitsuba ask for it.
os.environ.setdefault("LIPPMANN_MITSUBA", "off")

heed_ctrl_c()
watch_this_run()
