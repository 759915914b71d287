"""``scenelang sweep``: a scene with many values of its params."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.say import Bar, say_diagnostics
from scenelang.drawing.how import How
from scenelang.language.diagnostics import plural


def _grid(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """NAME=VALUES, or NAME alone; several times."""
    result: dict[str, str] = {}
    for text in given:
        name, _, values = (part.strip() for part in text.partition("="))
        if not re.fullmatch(r"[A-Za-z_]\w*", name):
            raise click.BadParameter(f"`{text}` is not NAME=VALUES", ctx, param)
        if name in result:
            raise click.BadParameter(f"`{name}` is given twice", ctx, param)
        result[name] = values
    return result


def _random(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """NAME or NAME=A..B, several times or between commas."""
    return _grid(ctx, param, tuple(part for text in given for part in text.split(",") if part.strip()))


@click.command("sweep")
@click.argument("scene", metavar="SCENE", type=click.Path(path_type=Path))
@options.writes("OUT", "Folder to write to, or pictures such as out/%05d.png.")
@options.text(
    "--grid", "NAME=VALUES", "Values of a param: k=0..1/10 for ten, k=0.1,0.5, k=0..1 step 0.25, k=../5 of "
    "its own range, or k alone for each choice. Of several all combinations are drawn.",
    multiple=True, callback=_grid,
)  # fmt: skip
@options.text(
    "--random", "NAME,…", "Params to draw at random from their ranges, or NAME=A..B from another range.",
    multiple=True, callback=_random,
)  # fmt: skip
@options.count("--count", help="Number of pictures; by default the grid once.")
@options.count("--seed", low=0, default=0, help="Seed of the random values.")
@options.several(
    "--output", "outputs", of=("depth", "normal", "object", "alpha", "scene", "program"),
    help="Output to write beside each picture",
)  # fmt: skip
@click.option("--sheet", metavar="FILE", help="Write a picture of all pictures, small.")
@click.option("--table", metavar="FILE", help="Write a copy of the table, .csv or .parquet.")
@options.request()
@options.drawing()
@options.film("jobs", "cluster")
@options.verbose
def command(
    scene: Path,
    out: str,
    request: options.Request,
    how: How,
    film: options.FilmOptions,
    verbose: bool,
    **given: Any,  # arguments of `render_many` by their names
) -> None:
    """Draw SCENE with many values of its params.

    OUT gets a picture for each row of values, STEM-000000.png and so on, and STEM.csv, a table of pictures
    and values. Rows whose values give no scene have no picture; the table says why, and the exit code is 1.
    A run that was interrupted goes on where it stopped, and one with a larger --count adds to what is there.
    """
    from scenelang.language.evaluation import ParamError
    from scenelang.output.frames import TargetError
    from scenelang.output.sweep import render_many

    started, source = time.perf_counter(), request.source
    try:
        with Bar() as bar:
            sweep = render_many(
                scene, out, params=source.values, model=source.model, root=source.root, size=source.size,
                frame=request.frame or 0, jobs=film.jobs, cluster=film.cluster,
                progress=lambda now: bar(now.told, now.done, now.total), **how._asdict(), **given,
            )  # fmt: skip
    except (ParamError, TargetError) as error:
        raise click.UsageError(f"{error}.") from None
    except ValueError as error:  # of another sweep, or a format that cannot be written
        raise Trouble(str(error)) from None
    say_diagnostics(sweep.warnings)
    for number, errors in sweep.failed.items():
        values = zip(sweep.names, sweep.lines[number].values, strict=True)
        click.echo(f"row {number}: {', '.join(f'{name}={value}' for name, value in values)}", err=True)
        say_diagnostics(errors)
    made = sweep.made
    parts = [plural(len(sweep.lines) - sweep.errors, "picture")]
    if sweep.errors:
        parts.append(f"{plural(sweep.errors, 'row')} whose values give no scene")
    if made.resumed:
        parts.append(f"{made.resumed:,} kept from a run before")
    if same := made.frames - sweep.errors - made.drawn - made.resumed:
        parts.append(f"{same:,} the same as others")
    click.echo(f"{sweep.table}: {', '.join(parts)}, {time.perf_counter() - started:.1f} s", err=True)
    for line in made.lines() if verbose else ():
        click.echo(f"  {line}", err=True)
    if sweep.errors:
        raise click.exceptions.Exit(1)
