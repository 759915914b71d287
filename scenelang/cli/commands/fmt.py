"""``scenelang fmt``: scene text in its canonical layout; of the pipeline it imports the parser alone."""

from __future__ import annotations

import sys
from collections import Counter
from typing import Literal

import click

from scenelang.assets.files import followed, read_regular, write_whole
from scenelang.assets.records import deep_stack
from scenelang.cli.files import STDIN, scenes_of
from scenelang.cli.main import describe
from scenelang.cli.say import say_diagnostics, say_trouble, show_difference
from scenelang.language.diagnostics import plural
from scenelang.language.formatting import format_text
from scenelang.language.limits import MAX_BYTES
from scenelang.language.reports import SceneError, render_concise


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
    names, readable = scenes_of(paths)
    with deep_stack():
        counts = Counter[str](_format(name, check, diff) for name in names)
    would = "would be " if check or diff else ""
    told = {
        "changed": f"{would}formatted",
        "same": "left as they are" if counts["same"] != 1 else "left as it is",
        "mistaken": "with syntax errors",
    }
    parts = [f"{plural(counts[key], 'scene')} {what}" for key, what in told.items() if counts[key]]
    if parts and STDIN not in names:
        click.echo(", ".join(parts), err=True)
    wrong = counts["mistaken"] or (counts["changed"] and (check or diff))
    ctx.exit(2 if counts["unreadable"] or not readable else int(bool(wrong)))


def _format(name: str, check: bool, diff: bool) -> Literal["changed", "same", "mistaken", "unreadable"]:
    """Format one file, or with ``check`` or ``diff`` only name or show what would change."""
    shown = "<stdin>" if name == STDIN else name
    try:
        data = sys.stdin.buffer.read(MAX_BYTES + 1) if name == STDIN else read_regular(name, MAX_BYTES)
        if len(data) > MAX_BYTES:
            say_trouble(f"{shown}: a file of more than {MAX_BYTES // 1_000_000} MB")
            return "unreadable"
        text = data.decode("utf-8")
        result = format_text(text, name=shown)
        if check or diff:
            pass
        elif name == STDIN:
            sys.stdout.flush()
            sys.stdout.buffer.write(result.encode("utf-8"))
            sys.stdout.buffer.flush()
        elif result != text:
            write_whole(followed(name), result.encode("utf-8"))
    except UnicodeDecodeError as error:
        say_trouble(f"{shown}: it is not UTF-8 text: byte {error.start}")
        return "unreadable"
    except OSError as error:
        say_trouble(describe(error))
        return "unreadable"
    except SceneError as error:
        if check:
            more = f", and {len(error.diagnostics) - 1:,} more" if error.diagnostics[1:] else ""
            click.echo(f"{render_concise(error.diagnostics[:1]).rstrip()}{more}", err=True)
        else:
            say_diagnostics(error.diagnostics)
        return "mistaken"
    if result == text:
        return "same"
    if diff:
        show_difference(shown, text, result)
    elif check:
        click.echo(f"would format {shown}")
    return "changed"
