"""Animations from the command line: what is drawn, what is said about it."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.filesize import decimal

from scenelang.animation.clip import Clip
from scenelang.animation.targets import PICTURES, Target, TargetError, find_target, is_animation
from scenelang.animation.timing import FrameRange, FramesError
from scenelang.cli.inputs import Input, stem_of
from scenelang.cli.main import Trouble, describe
from scenelang.cli.outputs import check_outputs
from scenelang.cli.progress import Bar
from scenelang.cli.say import say_diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import listing, plural
from scenelang.records import Record

if TYPE_CHECKING:
    from scenelang.animation.gif import Palette
    from scenelang.animation.run import RenderResult
    from scenelang.backend.options import How
    from scenelang.outputs import Output


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
        """Whether nothing but an animation will do."""
        return self.range is not None or self.fps is not None

    @property
    def frames(self) -> FrameRange:
        """Which frames; raises `click.UsageError` where the range is not one."""
        try:
            return FrameRange() if self.range is None else FrameRange.parse(self.range)
        except FramesError as error:
            raise click.BadParameter(str(error), param_hint="--frames") from None

    def target(self, name: str, out: str) -> Target | None:
        """The file or folder of a scene's animation, if it has one; None where ``out`` is a single picture.

        Raises `click.UsageError` where frames are asked for all the same.
        """
        if not (is_animation(out) or out.endswith(("/", "\\")) or Path(out).is_dir() or self.certain):
            return None
        try:
            return find_target(out, stem_of(name))
        except TargetError as error:
            raise click.UsageError(f"{error}.") from None


def moves(found: Input, target: Target, film: Film, out: str) -> bool:
    """True where a scene is drawn as an animation and not as one picture; reports where it cannot be.

    Raises `click.UsageError` where ``out`` cannot hold a picture.
    """
    if found.diagnostics.errors or (found.evaluation is not None and found.evaluation.animates):
        return True
    if film.certain:
        which = "--frames" if film.frames != FrameRange() else "--fps"
        found.diagnostics.add("E0337", f"{which} for a scene without animate(…)", None)
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
    found: Input,
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
        found: the scene.
        out: the target, as the user wrote it.
        outputs: to write beside each picture.
        strict: count warnings as errors.
        verbose: say where the time went.

    Raises:
        Trouble: a file cannot be written.
    """
    from scenelang.animation.painting import Painter
    from scenelang.animation.run import make

    started, told = time.perf_counter(), found.diagnostics
    drawn = found.evaluation or ((found.scene,) if found.scene is not None else ())
    if told.errors or not drawn:
        say_diagnostics(told)
        return 1
    clip = Clip(drawn, told)
    numbers = None
    with suppress(SceneError):  # its diagnostics are told
        numbers = clip.numbers(film.frames)
    if numbers is None or (told.items and strict):
        say_diagnostics(told)
        return 1
    if outputs and target.kind != "sequence":
        what = f"`{out}` is one file; numbered pictures such as frame-%04d.png have outputs"
        raise click.UsageError(f"{what}.")
    check_outputs([target.file(number) for number in numbers], outputs)
    try:
        with Bar() as bar:
            made = make(
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
        say_diagnostics(told)
        return 1
    except KeyboardInterrupt:
        if target.work.exists():
            kept = f"\nframes are kept in `{target.work}`; the same command goes on with the rest"
            click.echo(kept, err=True)
        raise
    except OSError as error:
        raise Trouble(f"cannot write `{out}`: {describe(error)}") from None
    say_diagnostics(told)
    click.echo(summary(made, time.perf_counter() - started), err=True)
    if (others := strays(target, made)) is not None:
        click.echo(f"note: {others}", err=True)
    for line in made.lines() if verbose else ():
        click.echo(f"  {line}", err=True)
    return 0


def summary(made: RenderResult, seconds: float) -> str:
    """A line about what was written."""
    first, last = made.files[0], made.files[-1]
    name = f"{first} … {last.name}" if len(made.files) > 1 else str(first)
    size = decimal(sum(file.stat().st_size for file in made.files))
    parts = [plural(made.frames, "frame"), size]
    if made.resumed:
        parts.append(f"{made.resumed} kept from a run before")
    if same := made.frames - made.drawn - made.resumed:
        parts.append(f"{same} the same as others")
    return f"{name}: {', '.join(parts)}, {seconds:.1f} s"


def strays(target: Target, made: RenderResult) -> str | None:
    """A line about files of a sequence that this run did not write."""
    if target.kind != "sequence":
        return None
    others = {path.name for path in target.there()}
    others -= {file.name for file in made.files}
    if not others:
        return None
    count, among = plural(len(others), "such file"), " among them" if len(others) > 1 else ""
    return f"`{target.path}` also holds {count} of another run, `{min(others)}`{among}"
