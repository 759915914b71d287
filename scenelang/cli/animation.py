"""Animations from the command line: what is drawn, what is said about it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scenelang.animation.clip import Clip
from scenelang.animation.targets import PICTURES, Target, TargetError, find_target, is_animation
from scenelang.animation.timing import FrameRange, FramesError
from scenelang.cli.inputs import STDIN, Request, read_text
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.diagnostics.suggest import listing

if TYPE_CHECKING:
    from scenelang.animation.run import Made

SIZES = ("B", "kB", "MB", "GB")


class Wanted:
    """What the command line says about animations.

    Args:
        frames: which frames; None for all.
        fps: frames a second instead of the scene's.
        jobs: processes that draw.
        palette, dither: of a GIF.
    """

    def __init__(
        self,
        frames: str | None,
        fps: float | None,
        jobs: int | None,
        palette: Literal["auto", "global", "frame"],
        dither: bool,
    ) -> None:
        try:
            self.frames = FrameRange() if frames is None else FrameRange.parse(frames)
        except FramesError as error:
            raise click.BadParameter(str(error), param_hint="--frames") from None
        self.fps, self.jobs, self.palette, self.dither = fps, jobs, palette, dither
        self.certain = frames is not None or fps is not None


def wanted_target(name: str, out: str, wanted: Wanted) -> Target | None:
    """Where the animation of a scene goes if it has one; None where ``out`` is a single picture.

    Raises:
        click.UsageError: frames are asked for, and ``out`` holds one picture.
    """
    folder = out.endswith(("/", "\\")) or Path(out).is_dir()
    if not (is_animation(out) or folder or wanted.certain):
        return None
    try:
        return find_target(out, "stdin" if name == STDIN else Path(name).stem)
    except TargetError as error:
        raise click.UsageError(f"{error}.") from None


def open_input(
    name: str, request: Request, wanted: Wanted, found: Diagnostics
) -> tuple[SourceFile | None, Clip | None]:
    """The text of a scene, and the scene; None for what has errors.

    Raises:
        OSError: it cannot be opened.
    """
    source = read_text(name, found)
    if source is None:
        return None, None
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
    try:
        _ = clip.first
    except SceneError:
        return source, None
    return source, clip


def still_picture(clip: Clip, target: Target, wanted: Wanted, out: str) -> bool:
    """Whether a scene without an animation is drawn as one picture; reports where it cannot be.

    Raises:
        click.UsageError: ``out`` cannot hold one.
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


def frames_of(clip: Clip, wanted: Wanted) -> range | None:
    """The numbers of the frames that are asked for; None after a report that some are not there."""
    try:
        return wanted.frames.among(clip.animation.frames)
    except FramesError as error:
        animation = clip.animation
        help = f"{animation.seconds:g} s at {animation.fps:g} frames a second are {animation.frames} frames"
        clip.diagnostics.add("E0337", str(error), None, help=help)
        return None


def summary(made: Made, target: Target, clip: Clip, started: float) -> str:
    """A line about what was written."""
    first, last = made.files[0], made.files[-1]
    name = f"{first} … {last.name}" if len(made.files) > 1 else str(first)
    size = readable(sum(file.stat().st_size for file in made.files))
    parts = [f"{made.frames} frame{'s' * (made.frames != 1)}", size]
    if made.resumed:
        parts.append(f"{made.resumed} kept from a run before")
    same = made.frames - made.drawn - made.resumed
    if same:
        parts.append(f"{same} the same as others")
    return f"{name}: {', '.join(parts)}, {time.perf_counter() - started:.1f} s"


def strays(target: Target, made: Made) -> str | None:
    """A line about files of a sequence that this run did not write."""
    if target.kind != "sequence":
        return None
    head, tail = made_pattern(target)
    mine = {file.name for file in made.files}
    others = [
        p.name
        for p in target.path.iterdir()
        if p.name not in mine
        and p.name.startswith(head)
        and p.name.endswith(tail)
        and p.name[len(head) : len(p.name) - len(tail)].isdigit()
    ]
    if not others:
        return None
    return f"`{target.path}` also holds {len(others)} such files of another run, `{min(others)}` among them"


def made_pattern(target: Target) -> tuple[str, str]:
    """What stands before and after the number in the names of a sequence."""
    probe = [target.file(n).name for n in (111111, 222222)]
    at = probe[0].index("111111")
    return probe[0][:at], probe[0][at + 6 :]


def readable(size: float) -> str:
    """Bytes as people read them."""
    for unit in SIZES:
        if size < 1000 or unit == SIZES[-1]:
            return f"{size:.0f} {unit}" if size >= 100 or unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    raise AssertionError
