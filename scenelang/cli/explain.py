"""``scenelang explain``: what a diagnostic's code stands for."""

from __future__ import annotations

import click

_AREAS = {
    "01": "syntax",
    "02": "names",
    "03": "types and values",
    "04": "graph and booleans",
    "05": "what a model can do",
}


@click.command("explain")
@click.argument("code")
def command(code: str) -> None:
    """Say what CODE means, such as E0401."""
    from scenelang.diagnostics.codes import CODES

    wanted = code.strip().upper()
    if wanted not in CODES:
        raise click.UsageError(f"No code '{code}'; codes look like E0401 and W0501.")
    severity = "warning" if wanted.startswith("W") else "error"
    click.echo(f"{severity} {wanted} ({_AREAS[wanted[1:3]]}): {CODES[wanted]}")
