"""Animations from the command line, and ``scenelang sweep``."""

from __future__ import annotations

import re
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.filesize import decimal

from scenelang.assets.records import Record
from scenelang.cli import inputs
from scenelang.cli.inputs import Input, stem_of
from scenelang.cli.jobs import check_outputs
from scenelang.cli.main import Trouble, describe
from scenelang.cli.say import Bar, say_diagnostics
from scenelang.language.diagnostics import listing, plural
from scenelang.language.reports import SceneError
from scenelang.output.frames import (
    PICTURES,
    Clip,
    FrameRange,
    FramesError,
    Target,
    TargetError,
    find_target,
    is_animation,
)

if TYPE_CHECKING:
    from scenelang.cli.inputs import Request
    from scenelang.drawing.how import How
    from scenelang.drawing.image import Output
    from scenelang.output.animate import RenderResult
    from scenelang.output.encoders import Palette
    from scenelang.output.sweep import Kind, Sweep


class Film(Record):
    """Options of the command line for animations alone."""

    range: str | None = None  # `--frames`; None for all
    fps: float | None = None  # frames a second instead of the scene's
    jobs: int | None = None  # processes that draw
    cluster: str | None = None  # whose workers draw
    # of a GIF
    palette: Palette = "auto"
    dither: bool = False

    @property
    def certain(self) -> bool:
        """True where an option is for animations alone."""
        return self.range is not None or self.fps is not None

    @property
    def frames(self) -> FrameRange:
        """The range of frames; raises `click.UsageError` where the text is not a range."""
        try:
            return FrameRange() if self.range is None else FrameRange.parse(self.range)
        except FramesError as error:
            raise click.BadParameter(str(error), param_hint="--frames") from None

    def target(self, name: str, out: str) -> Target | None:
        """The target of a scene's animation; None where ``out`` is a single picture.

        Raises `click.UsageError` where it is one and frames are asked for.
        """
        if not (is_animation(out) or out.endswith(("/", "\\")) or Path(out).is_dir() or self.certain):
            return None
        try:
            return find_target(out, stem_of(name))
        except TargetError as error:
            raise click.UsageError(f"{error}.") from None


def moves(scene_input: Input, target: Target, film: Film, out: str) -> bool:
    """True where a scene is drawn as an animation and not as one picture, or has errors.

    Raises `click.UsageError` where ``out`` cannot hold a picture.
    """
    if scene_input.diagnostics.errors or (
        scene_input.evaluation is not None and scene_input.evaluation.animates
    ):
        return True
    if film.certain:
        which = "--frames" if film.frames != FrameRange() else "--fps"
        scene_input.diagnostics.add("E0337", f"{which} for a scene without animate(…)", None)
        return True
    if target.kind == "sequence":
        return "%" in out
    if target.path.suffix.lower() in PICTURES:
        return True
    suffixes = listing(sorted(PICTURES))
    raise click.UsageError(
        f"`{out}` is for animations, and the scene has no animate(…); {suffixes} hold a picture too."
    )


def animate(
    scene_input: Input,
    target: Target,
    film: Film,
    how: How,
    out: str,
    outputs: tuple[Output, ...],
    strict: bool,
    verbose: bool,
) -> int:
    """Draw an animation and give the exit code.

    Args:
        scene_input: the scene.
        out: the target, as the user wrote it.
        outputs: written next to each picture.
        strict: count warnings as errors.
        verbose: report times.

    Raises:
        Trouble: a file cannot be written.
    """
    from scenelang.output.animate import make
    from scenelang.output.painting import Painter

    started, diagnostics = time.perf_counter(), scene_input.diagnostics
    drawn = scene_input.evaluation or ((scene_input.scene,) if scene_input.scene is not None else ())
    if diagnostics.errors or not drawn:
        say_diagnostics(diagnostics)
        return 1
    clip = Clip(drawn, diagnostics)
    numbers = None
    with suppress(SceneError):  # its diagnostics are the input's
        numbers = clip.numbers(film.frames)
    if numbers is None or (diagnostics.items and strict):
        say_diagnostics(diagnostics)
        return 1
    if outputs and target.kind != "sequence":
        what = f"`{out}` is one file; numbered pictures such as frame-%04d.png have outputs"
        raise click.UsageError(f"{what}.")
    check_outputs([target.file(number) for number in numbers], outputs)
    try:
        with Bar() as bar:
            result = make(
                Painter(clip, how, outputs=outputs),
                target,
                numbers,
                jobs=film.jobs,
                cluster=film.cluster,
                palette=film.palette,
                dither=film.dither,
                strict=strict,
                progress=lambda now: bar(now.told, now.done, now.total),
            )
    except SceneError:
        say_diagnostics(diagnostics)
        return 1
    except KeyboardInterrupt:
        if target.work.exists():
            note = f"\nframes are kept in `{target.work}`; the same command goes on with the rest"
            click.echo(note, err=True)
        raise
    except OSError as error:
        raise Trouble(f"cannot write `{out}`: {describe(error)}") from None
    say_diagnostics(diagnostics)
    click.echo(summary(result, time.perf_counter() - started), err=True)
    if (others := strays(target, result)) is not None:
        click.echo(f"note: {others}", err=True)
    for line in result.lines() if verbose else ():
        click.echo(f"  {line}", err=True)
    return 0


def summary(result: RenderResult, seconds: float) -> str:
    """A line about the files that were written."""
    first, last = result.files[0], result.files[-1]
    name = f"{first} … {last.name}" if len(result.files) > 1 else str(first)
    size = decimal(sum(file.stat().st_size for file in result.files))
    parts = [plural(result.frames, "frame"), size]
    if result.resumed:
        parts.append(f"{result.resumed} kept from a run before")
    if same := result.frames - result.drawn - result.resumed:
        parts.append(f"{same} the same as others")
    return f"{name}: {', '.join(parts)}, {seconds:.1f} s"


def strays(target: Target, result: RenderResult) -> str | None:
    """A line about files of a sequence that this run did not write."""
    if target.kind != "sequence":
        return None
    others = {path.name for path in target.there()}
    others -= {file.name for file in result.files}
    if not others:
        return None
    count, among = plural(len(others), "such file"), " among them" if len(others) > 1 else ""
    return f"`{target.path}` also holds {count} of another run, `{min(others)}`{among}"


BESIDE = ("depth", "normal", "object", "alpha", "scene", "program")


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
@inputs.request
@inputs.drawing()
@inputs.jobs
@inputs.cluster
@inputs.verbose
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
    from scenelang.language.evaluation import ParamError
    from scenelang.output.sweep import render_many

    started = time.perf_counter()
    try:
        with Bar() as bar:
            sweep = render_many(
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
    _say(sweep, time.perf_counter() - started)
    for line in sweep.made.lines() if verbose else ():
        click.echo(f"  {line}", err=True)
    ctx.exit(1 if sweep.errors else 0)


def _say(done: Sweep, seconds: float) -> None:
    """Print the result of a sweep."""
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
