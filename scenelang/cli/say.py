"""Output of commands: diagnostics, files, differences, times and progress."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any, Final

import click

from scenelang.language.diagnostics import Diagnostic

if TYPE_CHECKING:
    from rich.progress import Progress

SUFFIX: Final = ".nsg"


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
    from scenelang.language.reports import WIDTH

    if not stream.isatty():
        return WIDTH
    return shutil.get_terminal_size((WIDTH, 24)).columns


def say_diagnostics(diagnostics: Iterable[Diagnostic]) -> None:
    """Print diagnostics for people, with carets, to standard error."""
    from scenelang.language.reports import render_text

    text = render_text(diagnostics, wants_color(sys.stderr), width=width_of(sys.stderr))
    if text:
        click.echo(text, err=True, nl=False, color=True)


def say_trouble(message: str) -> None:
    """Print an error without a place in a scene to standard error."""
    click.echo(f"Error: {message}", err=True)


def put_out(result: str | bytes, out: str | None) -> None:
    """Write a command's result to a file, whole or not at all; ``-`` or None is standard output."""
    if out is None or out == "-":
        click.echo(result, nl=False)
        return
    from scenelang.assets.files import write_output

    write_output(out, result.encode() if isinstance(result, str) else result)


def need_metrics() -> None:
    """Stop with advice where the packages that measure pictures are not installed."""
    for name in ("flip_evaluator", "pytorch_msssim"):
        if importlib.util.find_spec(name) is None:
            raise click.UsageError(f"{name} is missing; pip install 'scenelang[eval]'")


def difference(name: str, before: str, after: str) -> str:
    """A unified diff, as `patch -p0` takes it; lines end at line feeds and nowhere else."""
    from difflib import unified_diff

    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
        for line in unified_diff(_lines(before), _lines(after), name, name)
    )


def _lines(text: str) -> list[str]:
    """Lines with their ends; text after the last line feed is a line unless it is empty."""
    lines = [f"{line}\n" for line in text.split("\n")]
    last = lines.pop()[:-1]
    return [*lines, last] if last else lines


def show_difference(name: str, before: str, after: str, color: str = "auto") -> None:
    """Print a unified diff: exact into files and pipes, coloured, without control characters on terminals."""
    from scenelang.language.reports import paint, printable

    painted = wants_color(sys.stdout, color)
    for line in difference(name, before, after).removesuffix("\n").split("\n"):
        style = "bold" if line.startswith(("--- ", "+++ ")) else _DIFF_STYLES.get(line[:1], "")
        safe = printable(line) if painted or sys.stdout.isatty() else line
        click.echo(paint(style, safe, painted), color=True)


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

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown is not None:
            self._shown.stop()

    def __call__(self, what: str, done: float, total: float) -> None:
        """Report how much of the total is done, from any thread; less than before begins the next stage."""
        if not self._wanted:
            return
        with self._lock:
            if self._shown is None:
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


def named(paths: Iterable[str], lost: Callable[[OSError], None]) -> Iterator[str]:
    """The scenes of a command line: files, ``-`` too, and those in folders by name; no hidden ones or links.

    ``lost`` is told of folders that cannot be listed.
    """
    for path in paths:
        if not os.path.isdir(path):
            yield path
            continue
        try:
            with os.scandir(path) as entries:
                found = sorted(entries, key=lambda entry: entry.name)
        except OSError as error:
            lost(error)
            continue
        shown = [entry for entry in found if not (entry.name.startswith(".") or entry.is_symlink())]
        inside = [e.path for e in shown if e.is_dir() or (e.name.endswith(SUFFIX) and e.is_file())]
        yield from named(inside, lost)
