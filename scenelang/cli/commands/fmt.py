"""``scenelang fmt``: scene text in its canonical layout; of the pipeline it imports the parser alone."""

from __future__ import annotations

import sys
from typing import Final

import click

from scenelang.assets.files import followed, read_regular, write_whole
from scenelang.assets.records import deep_stack
from scenelang.cli.main import describe
from scenelang.cli.say import SUFFIX, named, say_diagnostics, say_trouble, show_difference
from scenelang.language.diagnostics import plural
from scenelang.language.limits import MAX_BYTES
from scenelang.language.reports import SceneError

STDIN: Final = "-"


@click.command("fmt")
@click.argument("paths", nargs=-1, required=True, metavar="PATH…")
@click.option(
    "--check", is_flag=True, help="Write nothing; name the files that are laid out otherwise, on a line each."
)
@click.option("--diff", is_flag=True, help="Write nothing; print what would change.")
@click.pass_context
def command(ctx: click.Context, paths: tuple[str, ...], check: bool, diff: bool) -> None:
    """Lay scenes out in the one canonical way, comments and blank lines kept.

    PATH is a scene, a folder of scenes (*.nsg, also in folders inside; hidden ones and links are passed
    over), or - to read standard input and write to standard output. A file with syntax errors is reported
    and stays as it is.

    Exits with 0, or 1 where a scene has syntax errors or, with --check or --diff, where something would
    change, and 2 where a file cannot be read or written.
    """
    run = _Run(check, diff)
    with deep_stack():
        for name in named(paths, run.lose):
            run.take(name)
    run.summarise()
    wrong = run.mistaken or (run.changed and (check or diff))
    ctx.exit(2 if run.unreadable else int(bool(wrong)))


class _Run:
    """One run over any number of files; ``check`` and ``diff`` only name or show what would change."""

    def __init__(self, check: bool, diff: bool) -> None:
        self.check, self.diff = check, diff
        self.writes = not (check or diff)
        self.changed = self.same = self.mistaken = self.unreadable = 0
        self.stdin = False

    def lose(self, error: OSError) -> None:
        """Report what cannot be read or written."""
        say_trouble(describe(error))
        self.unreadable += 1

    def take(self, name: str) -> None:
        """Format one file."""
        from scenelang.language.formatting import format_text

        try:
            text = self._read(name)
            if text is None:
                return
            result = format_text(text, name=_shown(name))
        except SceneError as error:
            if self.check:
                from scenelang.language.machine import render_concise

                more = f", and {len(error.diagnostics) - 1:,} more" if error.diagnostics[1:] else ""
                click.echo(f"{render_concise(error.diagnostics[:1]).rstrip()}{more}", err=True)
            else:
                say_diagnostics(error.diagnostics)
            self.mistaken += 1
            return
        except OSError as error:
            self.lose(error)
            return
        if result == text:
            self.same += 1
        else:
            self.changed += 1
            if self.diff:
                show_difference(_shown(name), text, result)
            elif self.check:
                click.echo(f"would format {_shown(name)}")
        if self.writes:
            self._write(name, text, result)

    def _read(self, name: str) -> str | None:
        """The text; None after a report."""
        if name == STDIN:
            self.stdin = True
            data = sys.stdin.buffer.read(MAX_BYTES + 1)
        else:
            data = read_regular(name, MAX_BYTES)
        if len(data) > MAX_BYTES:
            say_trouble(f"{_shown(name)}: a file of more than {MAX_BYTES // 1_000_000} MB")
        else:
            try:
                return data.decode("utf-8")
            except UnicodeDecodeError as error:
                say_trouble(f"{_shown(name)}: it is not UTF-8 text: byte {error.start}")
        self.unreadable += 1
        return None

    def _write(self, name: str, text: str, result: str) -> None:
        if name == STDIN:
            sys.stdout.flush()
            sys.stdout.buffer.write(result.encode("utf-8"))
            sys.stdout.buffer.flush()
        elif result != text:
            try:
                write_whole(followed(name), result.encode("utf-8"))
            except OSError as error:
                self.lose(error)
                self.changed -= 1

    def summarise(self) -> None:
        """Say how many files there were, where people read it."""
        if self.stdin or not (self.changed or self.same or self.mistaken or self.unreadable):
            if not self.stdin:
                say_trouble(f"no scenes (*{SUFFIX}) there")
                self.unreadable += 1
            return
        would = "" if self.writes else "would be "
        counts = [
            (self.changed, f"{would}formatted"),
            (self.same, "left as they are" if self.same != 1 else "left as it is"),
            (self.mistaken, "with syntax errors"),
        ]
        parts = [f"{plural(n, 'scene')} {what}" for n, what in counts if n]
        if parts:
            click.echo(", ".join(parts), err=True)


def _shown(name: str) -> str:
    return "<stdin>" if name == STDIN else name
