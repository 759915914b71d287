"""Animations from the command line: what is drawn, what is said about it."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.filesize import decimal

from scenelang.animation.clip import Clip
from scenelang.animation.targets import PICTURES, Target, TargetError, find_target, is_animation
from scenelang.animation.timing import FrameRange, FramesError
from scenelang.cli.inputs import STDIN, Request, read_text, stem_of, unused_defines
from scenelang.cli.main import Trouble, describe
from scenelang.cli.outputs import check_outputs
from scenelang.cli.progress import Bar
from scenelang.cli.say import say_diagnostics
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.diagnostics.suggest import listing, plural

if TYPE_CHECKING:
    from scenelang.animation.gif import Palette
    from scenelang.animation.run import RenderResult
    from scenelang.backend.options import Backend, Device
    from scenelang.outputs import Output


@dataclass(frozen=True, slots=True)
class Requested:
    """What the command line says about animations."""

    range: str | None  # `--frames`; None for all
    fps: float | None  # frames a second instead of the scene's
    jobs: int | None = None  # processes that draw
    cluster: str | None = None  # whose workers draw
    # of a GIF
    palette: Palette = "auto"
    dither: bool = False
    # how frames are drawn
    backend: Backend = "neural"
    device: Device = "auto"
    threads: int | None = None
    strict: bool = False  # count warnings as errors
    verbose: bool = False  # say where the time went
    outputs: tuple[Output, ...] = ()  # beside each picture

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


def wanted_target(name: str, out: str, wanted: Requested) -> Target | None:
    """Where the animation of a scene goes if it has one; None where ``out`` is a single picture.

    Raises `click.UsageError` where frames are asked for all the same.
    """
    folder = out.endswith(("/", "\\")) or Path(out).is_dir()
    if not (is_animation(out) or folder or wanted.certain):
        return None
    try:
        return find_target(out, stem_of(name))
    except TargetError as error:
        raise click.UsageError(f"{error}.") from None


def still_picture(clip: Clip, target: Target, wanted: Requested, out: str) -> bool:
    """Whether a scene without an animation is drawn as one picture; reports where it cannot be.

    Raises `click.UsageError` where ``out`` cannot hold one.
    """
    if clip.animates:
        return False
    if wanted.certain:
        which = "--frames" if wanted.frames != FrameRange() else "--fps"
        clip.diagnostics.add("E0337", f"{which} for a scene without animate(…)", None)
        return False
    if target.kind == "sequence" and "%" not in out:
        return True
    if target.kind == "sequence" or target.path.suffix.lower() in PICTURES:
        return target.kind != "sequence"
    suffixes = listing(sorted(PICTURES))
    raise click.UsageError(
        f"`{out}` is for animations, and the scene has no animate(…); {suffixes} hold a picture too."
    )


def frames_of(clip: Clip, wanted: Requested) -> range | None:
    """The numbers of the frames that are asked for; None after a report that some are not there."""
    try:
        return wanted.frames.among(clip.animation.frames)
    except FramesError as error:
        animation = clip.animation
        count = plural(animation.frames, "frame")
        help = f"{animation.seconds:g} s at {animation.fps:g} frames a second make {count}"
        clip.diagnostics.add("E0337", str(error), None, help=help)
        return None


def animate(name: str, out: str, target: Target, request: Request, wanted: Requested) -> int | SourceFile:
    """Draw an animation; the exit code, or the scene's text if it is to be drawn as one picture.

    Raises:
        OSError: the scene cannot be read.
        Trouble: a file cannot be written.
    """
    from scenelang.animation.painting import Painter
    from scenelang.animation.run import make, ready

    started = time.perf_counter()
    found = Diagnostics()
    source = read_text(name, found)
    if source is None:
        say_diagnostics(found)
        return 1
    path = None if name == STDIN else Path(name)
    root = request.root if request.root is not None else "." if path is None else None
    clip = Clip(
        source,
        path=path,
        diagnostics=found,
        defines=request.defines,
        model=request.model,
        root=None if root is None else Path(root),
        size=request.size,
        fps=wanted.fps,
    )
    with suppress(SceneError):  # its diagnostics are `found`
        _ = clip.first
    if not found.errors and still_picture(clip, target, wanted, out):
        return source
    found.items.extend(unused_defines(request))
    numbers = frames_of(clip, wanted) if not found.errors else None
    if numbers is None or found.errors or (found.items and wanted.strict):
        say_diagnostics(found)
        return 1
    if wanted.outputs and target.kind != "sequence":
        what = f"`{out}` is one file; numbered pictures such as frame-%04d.png have outputs"
        raise click.UsageError(f"{what}.")
    check_outputs([target.file(number) for number in numbers], wanted.outputs)
    ready(target)
    painter = Painter(clip, wanted.backend, wanted.device, wanted.threads, outputs=wanted.outputs)
    try:
        with Bar() as bar:
            made = make(
                painter,
                target,
                numbers,
                jobs=wanted.jobs,
                cluster=wanted.cluster,
                palette=wanted.palette,
                dither=wanted.dither,
                strict=wanted.strict,
                progress=lambda now: bar(now.told, now.done, now.total),
            )
    except SceneError:
        say_diagnostics(found)
        return 1
    except KeyboardInterrupt:
        if target.work.exists():
            told = f"\nframes are kept in `{target.work}`; the same command goes on with the rest"
            click.echo(told, err=True)
        raise
    except OSError as error:
        raise Trouble(f"cannot write `{out}`: {describe(error)}") from None
    say_diagnostics(found)
    click.echo(summary(made, time.perf_counter() - started), err=True)
    if (others := strays(target, made)) is not None:
        click.echo(f"note: {others}", err=True)
    for line in made.lines() if wanted.verbose else ():
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
