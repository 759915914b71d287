"""``python -m lab plans``: what drawing scenes takes, and what leaving less out would cost."""

from __future__ import annotations

from pathlib import Path

import click

from lab.commands.common import write_json
from scenelang.cli.say import need_metrics


@click.command("plans")
@click.argument(
    "files", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True, dir_okay=False)
)
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), required=True, metavar="FILE", help="Record to write."
)
def command(files: tuple[Path, ...], out: Path) -> None:
    """Draw scenes on one thread and record their plans.

    Writes for each FILE what `scenelang explain-plan` says of it, and the meetings, time and PSNR with
    nothing skipped, with four samples in every pixel, and with hidden objects drawn.
    """
    need_metrics()
    from lab.parsimony import measure_examples

    found = measure_examples(
        files, lambda plan: click.echo(f"{plan['file']}: {plan['drawing']['ms']:.0f} ms", err=True)
    )
    write_json(out, found)
