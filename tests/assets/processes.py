"""Whole processes of the command line, which must end soon, in words and without leavings."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

SOON_S = 300
"""No command here needs a twentieth of it on an idle machine."""


def run(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; fails where it hangs."""
    command = [sys.executable, "-m", "scenelang", *arguments]
    options = {"stdout": subprocess.PIPE, "stdin": subprocess.DEVNULL, **options}
    return subprocess.run(command, stderr=subprocess.PIPE, text=True, timeout=SOON_S, check=False, **options)


def one_line(done: subprocess.CompletedProcess[str], code: int = 2) -> str:
    """The one error that a command told; usage errors have a hint before it."""
    assert done.returncode == code, (done.returncode, done.stderr)
    assert "Traceback" not in done.stderr
    errors = [line for line in done.stderr.splitlines() if line.startswith("Error: ")]
    assert len(errors) == 1, done.stderr
    return errors[0].removeprefix("Error: ")


def leavings(folder: Path) -> set[str]:
    """Every file under a folder, hidden ones too."""
    return {os.path.relpath(Path(at) / name, folder) for at, _, names in os.walk(folder) for name in names}
