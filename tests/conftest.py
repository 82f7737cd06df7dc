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

# A script ignores SIGINT for what it starts in the background, and children inherit that; they do not inherit a handler.
# A handler that does nothing leaves this process as deaf as before, and gives its children the signal as users have it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, lambda *_: None)
signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])

watch_this_run()
