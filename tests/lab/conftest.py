"""What the tests of the laboratory share."""

from __future__ import annotations

from click.testing import CliRunner, Result

from lab.cli import command


def run(*arguments: str) -> Result:
    """Run a command of the laboratory; whatever is not an exit is raised."""
    result = CliRunner().invoke(command, arguments, prog_name="python -m lab")
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result
