"""``scenelang convert``: scenes between text and JSON."""

from __future__ import annotations

from pathlib import Path

import click

from scenelang.cli import options
from scenelang.cli.inputs import read_input, unused_defines
from scenelang.cli.say import put_out, say_diagnostics
from scenelang.language.scene import to_readable_json


@click.command("convert")
@click.argument("file", metavar="FILE")
@options.out
@click.option(
    "--to", "kind", type=click.Choice(["nsg", "json"]),
    help="Format to write; by default the one of OUT's suffix (.nsg, .json).",
)  # fmt: skip
@options.request()
@click.pass_context
def command(
    ctx: click.Context, file: str, out: str | None, kind: str | None, request: options.Request
) -> None:
    """Write a scene as text or JSON.

    FILE is a scene, as text or JSON (.json), or - for standard input. What is written has no params,
    loops or imports left, only objects and numbers, which are kept exactly: it reads back as the same scene.
    """
    wanted = kind or Path(out or "").suffix.lower()[1:]
    if wanted not in ("nsg", "json"):
        raise click.UsageError("Say what to write: --to nsg or json, or -o with such a suffix.")
    result = read_input(file, request)
    result.diagnostics.items += unused_defines(request)
    say_diagnostics(result.diagnostics)
    if result.scene is None or result.diagnostics.errors:
        ctx.exit(1)
    put_out(to_readable_json(result.scene) if wanted == "json" else result.scene.to_nsg(), out)
