"""``scenelang convert``: scenes between text and JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import click

from scenelang.cli import inputs
from scenelang.cli.say import put_out, say_diagnostics

if TYPE_CHECKING:
    from scenelang.cli.inputs import Request


Kind = Literal["nsg", "json"]
SUFFIXES: Final[dict[str, Kind]] = {".nsg": "nsg", ".json": "json"}


@click.command("convert")
@click.argument("file", metavar="FILE")
@inputs.out
@click.option(
    "--to",
    "kind",
    type=click.Choice(["nsg", "json"]),
    help="Format to write; by default the one of OUT's suffix (.nsg, .json).",
)
@inputs.request
@click.pass_context
def command(ctx: click.Context, file: str, out: str | None, kind: Kind | None, request: Request) -> None:
    """Write a scene as text or JSON.

    FILE is a scene, as text or JSON (.json), or - for standard input. What is written has no params,
    loops or imports left, only objects and numbers, which are kept exactly: it reads back as the same scene.
    """
    from scenelang.cli.inputs import read_input, unused_defines

    wanted = kind or SUFFIXES.get(Path(out or "").suffix.lower())
    if wanted is None:
        raise click.UsageError("Say what to write: --to nsg or json, or -o with such a suffix.")
    result = read_input(file, request)
    result.diagnostics.items += unused_defines(request)
    say_diagnostics(result.diagnostics)
    if result.scene is None or result.diagnostics.errors:
        ctx.exit(1)
    from scenelang.language.scene import to_readable_json

    put_out(to_readable_json(result.scene) if wanted == "json" else result.scene.to_nsg(), out)
