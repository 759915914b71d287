"""Facts of the machine and the revision for every record, and reports of progress."""

from __future__ import annotations

import json
import platform
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import torch

from scenelang.assets.files import write_whole

Report = Callable[[str, int, int], None]
"""Called with what is measured, how much of it is done, and all."""
FOLDERS: Final = {"-o", "--out", "--kept", "--known", "--cluster"}
"""Options of commands that change where things lie or are done, and no figure."""
ORIGINALS: Final = "--originals"  # which figures need, wherever they lie


def silent(what: str, done: int, count: int) -> None:
    """A report that says nothing."""


def about() -> dict[str, Any]:
    """The command that is running, revision, kind of machine, torch and its threads."""
    return {
        "command": command_line(sys.argv),
        "revision": revision(),
        "machine": platform.machine(),
        "torch": torch.__version__.split("+")[0],
        "threads": torch.get_num_threads(),
    }


def write_json(path: Path, value: Any) -> None:
    """Write a record whole, and its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, (json.dumps(value, indent=1) + "\n").encode())


def command_line(argv: Sequence[str]) -> str:
    """The command as one types it, without where it reads and writes: ``python -m lab eval shapes2d``."""
    first = argv[0] if argv[0].startswith("python -m ") else Path(argv[0]).name
    return " ".join([first, *map(shlex.quote, _figures(argv[1:]))])


def _figures(arguments: Sequence[str]) -> Iterator[str]:
    """Arguments without those of `FOLDERS`."""
    left = iter(arguments)
    for argument in left:
        if argument in FOLDERS:
            next(left, None)
        elif argument == ORIGINALS:
            next(left, None)
            yield from (ORIGINALS, "FOLDER")
        elif argument.partition("=")[0] not in FOLDERS:
            yield argument


def revision() -> str:
    """The git revision of the source, or 'unknown' outside a checkout."""
    try:
        command, here = ["git", "rev-parse", "HEAD"], Path(__file__).parent
        out = subprocess.run(command, cwd=here, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return out.stdout.strip()
