"""``scenelang schema``: JSON Schemas of scenes and of what commands print."""

from __future__ import annotations

import json

import click

from scenelang.cli import options
from scenelang.cli.say import put_out


@click.command("schema")
@options.choice(
    "--kind", words="scene diagnostics",
    help="Schema of scenes as JSON, or of what `check --format json` prints.",
)  # fmt: skip
@options.out
def command(kind: str, out: str | None) -> None:
    """Print the JSON Schema (draft 2020-12) of scenes as JSON.

    Editors complete and check by it; validators refuse by it what scenelang refuses, as far as a schema
    can say.
    """
    from scenelang.editors.dumps import SCHEMAS

    put_out(json.dumps(SCHEMAS[kind](), indent=2, ensure_ascii=False) + "\n", out)
