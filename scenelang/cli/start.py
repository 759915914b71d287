"""The start of the process: from here on an interruption is quiet, also during imports."""

from __future__ import annotations

import gc
import os
import signal
from types import FrameType

_INTERRUPTED = 130  # 128 and the signal's number, as shells report it
_TERMINATED = 143
# Objects: imported ones live on, and looking for cycles in them costs a twentieth of a check.
_COLLECTED_AFTER = 50_000
_UNLESS_SET = {
    "OPENBLAS_NUM_THREADS": "1",  # numpy's products are too small to split, and threads are slow to start
    "PYDANTIC_DISABLE_PLUGINS": "__all__",  # looking for them reads the metadata of all that is installed
}


class Interruption(KeyboardInterrupt):
    """Ctrl-C; a plain `KeyboardInterrupt` that leaves `exec` ends the process whatever catches it later."""


def main() -> None:
    """Run the command line and exit.

    Ctrl-C and SIGTERM unwind what is running, so that nothing is left half-written.
    """
    try:
        signal.signal(signal.SIGTERM, _terminate)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where it is ignored
            signal.signal(signal.SIGINT, _interrupt)
        gc.set_threshold(_COLLECTED_AFTER)
        for name, value in _UNLESS_SET.items():
            os.environ.setdefault(name, value)
        from scenelang.cli.main import main as run

        run()
    except KeyboardInterrupt:
        raise SystemExit(_INTERRUPTED) from None
    finally:
        # What is left is for the interpreter to tidy up: an interruption there would only print a traceback.
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise Interruption


def _terminate(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a second one ends what does not unwind
    raise SystemExit(_TERMINATED)
