"""What commands print."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from typing import IO, Any

import click

from scenelang.diagnostics.diagnostic import Diagnostic


def wants_color(stream: IO[Any]) -> bool:
    """Whether a stream is a terminal whose user has not switched colours off (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def say_diagnostics(diagnostics: Iterable[Diagnostic]) -> None:
    """Print diagnostics for people, with carets, to standard error."""
    from scenelang.diagnostics.render_text import render_text

    text = render_text(diagnostics, wants_color(sys.stderr))
    if text:
        click.echo(text, err=True, nl=False, color=True)


def say_trouble(message: str) -> None:
    """Print one error that belongs to no place in a scene to standard error."""
    click.echo(f"Error: {message}", err=True)
