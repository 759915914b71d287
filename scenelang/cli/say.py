"""Output of commands: diagnostics, files, differences, times and progress."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

import click

from scenelang.assets.files import write_output
from scenelang.language.diagnostics import Diagnostic
from scenelang.language.reports import WIDTH, paint, printable, render_text

if TYPE_CHECKING:
    from rich.progress import Progress

STDOUT = "-", "/dev/stdout"  # names of standard output where a command writes to a file
_DIFF_STYLES = {"-": "removed", "+": "added", "@": "frame"}


def wants_color(stream: IO[Any], choice: str = "auto") -> bool:
    """True where output to a stream is coloured: ``always``, ``never``, or ``auto``.

    ``auto`` colours on terminals that can, unless the user has switched colours off (https://no-color.org).
    """
    if choice != "auto":
        return choice == "always"
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def width_of(stream: IO[Any]) -> int:
    """Cells of a line: the terminal's, or enough for most where there is none."""
    return WIDTH if not stream.isatty() else shutil.get_terminal_size((WIDTH, 24)).columns


def say_diagnostics(diagnostics: Iterable[Diagnostic]) -> None:
    """Print diagnostics for people, with carets, to standard error."""
    if text := render_text(diagnostics, wants_color(sys.stderr), width=width_of(sys.stderr)):
        click.echo(text, err=True, nl=False, color=True)


def say_trouble(message: str) -> None:
    """Print an error without a place in a scene to standard error."""
    click.echo(f"Error: {message}", err=True)


def put_out(result: str | bytes, out: str | None) -> None:
    """Write a command's result to a file, whole or not at all; ``-`` or None is standard output."""
    if out is None or out in STDOUT:
        click.echo(result, nl=False)
        return
    write_output(out, result.encode() if isinstance(result, str) else result)


def need_metrics() -> None:
    """Stop with advice where the packages that measure pictures are not installed."""
    for name in ("flip_evaluator", "pytorch_msssim"):
        if importlib.util.find_spec(name) is None:
            raise click.UsageError(f"{name} is missing; pip install 'scenelang[eval]'")


def show_difference(name: str, before: str, after: str, color: str = "auto") -> None:
    """Print a unified diff, as `patch -p0` takes it; lines end at line feeds and nowhere else.

    It is exact into files and pipes, and coloured, without control characters, on terminals.
    """
    from difflib import unified_diff

    painted = wants_color(sys.stdout, color)
    end = "\r" if "\r\n" in before and "\r\n" in after else ""  # the same on both sides: nothing to show
    # text after the last line feed is a line unless it is empty
    one, other = (re.findall(r"[^\n]*\n|[^\n]+", text) for text in (before, after))
    for line in unified_diff(one, other, name, name):
        style = "bold" if line.startswith(("--- ", "+++ ")) else _DIFF_STYLES.get(line[:1], "")
        text = line.removesuffix("\n")
        safe = printable(text.removesuffix(end)) if painted or sys.stdout.isatty() else text
        click.echo(paint(style, safe, painted), color=True)
        if text == line:
            click.echo("\\ No newline at end of file")


PATIENCE_S = 1.0


class Clock:
    """Seconds spent in each of a command's stages, in the order in which they first ran."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - started

    def report(self) -> str:
        """One line with all stages."""
        parts = [f"{stage} {1000 * seconds:.0f}" for stage, seconds in self.seconds.items()]
        return f"time (ms): {', '.join(parts)}"


class Bar:
    """A progress bar on a terminal, shown once the work has taken `PATIENCE_S`."""

    def __init__(self) -> None:
        self._wanted = sys.stderr.isatty()
        self._started = time.perf_counter()
        self._lock = threading.Lock()
        self._shown: Progress | None = None
        self._done = 0.0
        self._told: tuple[str, float, float | None] = ("", 0.0, None)
        self._timer = threading.Timer(PATIENCE_S, lambda: self(*self._told))  # though nothing is reported
        self._timer.daemon = True

    def __enter__(self) -> Bar:
        if self._wanted:
            self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        with self._lock:
            self._wanted = False
        if self._shown is not None:
            self._shown.stop()

    def __call__(self, what: str, done: float, total: float | None) -> None:
        """Report how much of the total is done, from any thread; less than before begins the next stage."""
        with self._lock:
            if not self._wanted:
                return
            if self._shown is None:
                self._told = what, done, total
                if time.perf_counter() - self._started < PATIENCE_S:
                    return
                from rich.console import Console
                from rich.progress import Progress

                self._shown = Progress(console=Console(stderr=True), transient=True)
                self._shown.add_task("")
                self._shown.start()
            task = self._shown.task_ids[0]
            if done < self._done:
                self._shown.reset(task)
            self._done = done
            self._shown.update(task, description=what, completed=done, total=total)
