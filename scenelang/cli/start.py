"""Where the process begins: an interruption is quiet from here to the end, whatever is being imported."""

from __future__ import annotations

import signal
from types import FrameType

_INTERRUPTED = 130  # 128 and the signal's number, as shells report it
_TERMINATED = 143


def main() -> None:
    """Run the command line and exit.

    Ctrl-C and SIGTERM unwind what is running, so that nothing is left half-written.
    """
    try:
        signal.signal(signal.SIGTERM, _terminate)
        from scenelang.cli.main import main as run

        run()
    except KeyboardInterrupt:
        raise SystemExit(_INTERRUPTED) from None
    finally:
        # What is left is for the interpreter to tidy up: an interruption there would only print a traceback.
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _terminate(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a second one ends what does not unwind
    raise SystemExit(_TERMINATED)
