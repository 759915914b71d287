"""``python -m lab COMMAND``: see `lab.cli`."""

from __future__ import annotations

import sys

from lab.cli import command

if __name__ == "__main__":
    sys.argv[0] = "python -m lab"  # as records say what made them
    command(prog_name=sys.argv[0])
