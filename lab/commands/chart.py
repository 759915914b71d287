"""``python -m lab chart``: tables, charts and strips of pictures out of measurements."""

from __future__ import annotations

import json
from pathlib import Path

import click

from scenelang.files import write_whole


@click.command("chart")
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "-o",
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Folder to write to; by default that of the measurements.",
)
def command(folder: Path, out: Path | None) -> None:
    """Draw what `python -m lab experiment` left in FOLDER.

    Of each NAME.json: NAME.md, a table with the paper's figures beside ours; NAME.png, a chart;
    NAME-strips.png, the same scenes drawn by every run.
    """
    try:
        from lab.experiments.charts import experiment_chart, strips
    except ImportError:
        raise click.UsageError("charts need matplotlib; pip install 'scenelang[charts]'") from None
    from lab.experiments.runs import EXPERIMENTS
    from lab.experiments.tables import table_of

    out = out or folder
    found = {name: folder / f"{name}.json" for name in EXPERIMENTS}
    found = {name: path for name, path in found.items() if path.exists()}
    if not found:
        raise click.UsageError(
            f"no experiments in {folder}; `python -m lab experiment NAME -o {folder}` makes them"
        )
    out.mkdir(parents=True, exist_ok=True)
    for name, path in found.items():
        result = json.loads(path.read_text("utf-8"))
        write_whole(out / f"{name}.md", (table_of(result) + "\n").encode())
        write_whole(out / f"{name}.png", experiment_chart(result))
        try:
            write_whole(out / f"{name}-strips.png", strips(result, folder).encode())
        except OSError as error:
            click.echo(f"{name}: no strips: {error}", err=True)
        click.echo(f"{name}: {out / name}.md, .png")
