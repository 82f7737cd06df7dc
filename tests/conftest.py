"""What all tests share."""

from __future__ import annotations

import os
import signal

from hypothesis import settings

from tests.leftovers import watch_this_run

# No test is timed: these machines are noisy, and the first example may import a library. In continuous integration the
# examples are the same every time, so that what lands is what was tried; at home they are new ones.
settings.register_profile("lippmann", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("lippmann")

# A shell without job control ignores SIGINT for what it starts in the background. Children inherit that a signal is
# ignored, but not that it is handled. With a handler that does nothing, this process goes on as before, and its
# children start as those of an interactive shell do.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, lambda *_: None)
signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])

watch_this_run()
