"""Wheels for Linux, macOS and Windows, all built on one machine: `python kernel/wheels.py dist`."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from build import HERE, TARGETS  # this folder's


def main() -> None:
    """Build a wheel for each machine that is asked for, into a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--target", choices=TARGETS, action="append", help="by default all of them")
    options = parser.parse_args()
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "-w",
        str(options.out),
        str(HERE.parent),
    ]
    for target in options.target or TARGETS:
        subprocess.run(command, env=os.environ | {"KERNEL_TARGET": target}, check=True)


if __name__ == "__main__":
    main()
