"""Changes of text as patches."""

from __future__ import annotations

import sys

import click

from scenelang.cli.say import wants_color

_STYLES = {"-": "removed", "+": "added", "@": "frame"}


def difference(name: str, before: str, after: str) -> str:
    """A unified diff, as `patch -p0` takes it; lines end at line feeds and nowhere else."""
    from difflib import unified_diff

    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
        for line in unified_diff(_lines(before), _lines(after), name, name)
    )


def _lines(text: str) -> list[str]:
    """Lines with their ends; what follows the last line feed is a line only if it holds something."""
    lines = [f"{line}\n" for line in text.split("\n")]
    last = lines.pop()[:-1]
    return [*lines, last] if last else lines


def show_difference(name: str, before: str, after: str, color: str = "auto") -> None:
    """Print a unified diff: exact into files and pipes, coloured and without control characters on terminals.

    Args:
        name: of the file.
        before, after: its texts.
        color: ``auto``, ``always`` or ``never``.
    """
    from scenelang.diagnostics.cells import paint, printable

    painted = wants_color(sys.stdout, color)
    for line in difference(name, before, after).removesuffix("\n").split("\n"):
        style = "bold" if line.startswith(("--- ", "+++ ")) else _STYLES.get(line[:1], "")
        safe = printable(line) if painted or sys.stdout.isatty() else line
        click.echo(paint(style, safe, painted), color=True)
