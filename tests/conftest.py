"""What all tests share."""

from __future__ import annotations

import signal

# A test run that was started in the background ignores interrupts, and so would the processes that tests
# start and interrupt: without this, `pytest &` waits for them for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
