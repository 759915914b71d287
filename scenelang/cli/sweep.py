"""``scenelang sweep``: one scene with many values of its params."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.progress import Bar
from scenelang.cli.say import say_diagnostics
from scenelang.diagnostics.suggest import plural

if TYPE_CHECKING:
    from scenelang.backend.options import How
    from scenelang.cli.inputs import Request
    from scenelang.sweep.api import Kind, Sweep

BESIDE = ("depth", "normal", "object", "alpha", "scene", "program")


def _grid(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """NAME=VALUES, or NAME alone; several times."""
    found: dict[str, str] = {}
    for text in given:
        name, _, values = (part.strip() for part in text.partition("="))
        if not re.fullmatch(r"[A-Za-z_]\w*", name):
            raise click.BadParameter(f"`{text}` is not NAME=VALUES", ctx, param)
        if name in found:
            raise click.BadParameter(f"`{name}` is given twice", ctx, param)
        found[name] = values
    return found


def _random(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """NAME or NAME=A..B, several times or between commas."""
    return _grid(ctx, param, tuple(part for text in given for part in text.split(",") if part.strip()))


@click.command("sweep")
@click.argument("scene", metavar="SCENE", type=click.Path(path_type=Path))
@click.option(
    "-o", "--out", required=True, metavar="OUT", help="Folder to write to, or pictures such as out/%05d.png."
)
@click.option(
    "--grid",
    multiple=True,
    metavar="NAME=VALUES",
    callback=_grid,
    help="Values of a param: k=0..1/10 for ten, k=0.1,0.5, k=0..1 step 0.25, k=../5 of its own range, "
    "or k alone for each choice. Of several all combinations are drawn.",
)
@click.option(
    "--random",
    multiple=True,
    metavar="NAME,…",
    callback=_random,
    help="Params to draw at random from their ranges, or NAME=A..B from another range.",
)
@click.option(
    "--count", type=click.IntRange(1), metavar="N", help="Number of pictures; by default the grid once."
)
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=click.IntRange(0),
    metavar="N",
    help="Seed of the random values.",
)
@click.option(
    "--output",
    "outputs",
    multiple=True,
    type=click.Choice(BESIDE),
    help="Output to write beside each picture; may be given several times.",
)
@click.option("--sheet", metavar="FILE", help="Write a picture of all pictures, small.")
@click.option("--table", metavar="FILE", help="Write a copy of the table, .csv or .parquet.")
@options.request
@options.drawing()
@options.jobs
@options.cluster
@options.verbose
@click.pass_context
def command(
    ctx: click.Context,
    scene: Path,
    out: str,
    grid: dict[str, str],
    random: dict[str, str],
    count: int | None,
    seed: int,
    outputs: tuple[Kind, ...],
    sheet: str | None,
    table: str | None,
    request: Request,
    how: How,
    jobs: int | None,
    cluster: str | None,
    verbose: bool,
) -> None:
    """Draw SCENE with many values of its params.

    OUT gets a picture for each row of values, STEM-000000.png and so on, and STEM.csv, a table of pictures
    and values. Rows whose values give no scene have no picture; the table says why, and the exit code is 1.
    A run that was interrupted goes on where it stopped, and one with a larger --count adds to what is there.
    """
    from scenelang.animation.targets import TargetError
    from scenelang.diagnostics.error import SceneError
    from scenelang.evaluate.ranges import ParamError
    from scenelang.sweep.api import render_many

    started = time.perf_counter()
    try:
        with Bar() as bar:
            made = render_many(
                scene, out, grid=grid, random=random, count=count, seed=seed, outputs=outputs, table=table,
                sheet=sheet, jobs=jobs, cluster=cluster, **request.named(), **how._asdict(),
                progress=lambda now: bar(now.told, now.done, now.total),
            )  # fmt: skip
    except (ParamError, TargetError) as error:
        raise click.UsageError(f"{error}.") from None
    except SceneError as error:
        say_diagnostics(error.diagnostics)
        ctx.exit(1)
    except ValueError as error:  # of another sweep, or a format that cannot be written
        raise Trouble(str(error)) from None
    _say(made, time.perf_counter() - started)
    for line in made.made.lines() if verbose else ():
        click.echo(f"  {line}", err=True)
    ctx.exit(1 if made.errors else 0)


def _say(done: Sweep, seconds: float) -> None:
    """What came of it."""
    say_diagnostics(done.warnings)
    for number, errors in done.failed.items():
        values = zip(done.names, done.lines[number].values, strict=True)
        click.echo(f"row {number}: {', '.join(f'{name}={value}' for name, value in values)}", err=True)
        say_diagnostics(errors)
    made = done.made
    parts = [plural(len(done.lines) - done.errors, "picture")]
    if done.errors:
        parts.append(f"{plural(done.errors, 'row')} whose values give no scene")
    if made.resumed:
        parts.append(f"{made.resumed:,} kept from a run before")
    if same := made.frames - done.errors - made.drawn - made.resumed:
        parts.append(f"{same:,} the same as others")
    click.echo(f"{done.table}: {', '.join(parts)}, {seconds:.1f} s", err=True)
