"""Animations from the command line."""

from __future__ import annotations

import time

import click
from rich.filesize import decimal

from scenelang.cli.files import check_outputs
from scenelang.cli.inputs import Input
from scenelang.cli.main import Trouble, describe
from scenelang.cli.options import Film
from scenelang.cli.say import Bar, say_diagnostics
from scenelang.drawing.image import Output
from scenelang.language.diagnostics import listing, plural
from scenelang.language.reports import SceneError
from scenelang.output.animate import make
from scenelang.output.frames import PICTURES, Clip, FrameRange, Target
from scenelang.output.painting import Painter


def moves(job: Input, target: Target, film: Film, out: str) -> bool:
    """True where a scene is drawn as an animation and not as one picture, or has errors.

    Raises `click.UsageError` where ``out`` cannot hold a picture.
    """
    if job.diagnostics.errors or (job.evaluation is not None and job.evaluation.animates):
        return True
    if film.certain:
        which = "--frames" if film.frames is not None else "--fps"
        job.diagnostics.add("E0337", f"{which} for a scene without animate(…)", None)
        return True
    if target.kind == "sequence":
        return "%" in out
    if target.path.suffix.lower() in PICTURES:
        return True
    fact = f"`{out}` is for animations, and the scene has no animate(…)"
    raise click.UsageError(f"{fact}; {listing(sorted(PICTURES))} hold a picture too.")


def animate(
    job: Input, target: Target, film: Film, out: str, outputs: tuple[Output, ...], strict: bool, verbose: bool
) -> None:
    """Draw an animation and report what was written; ``out`` is the target as the user wrote it.

    Raises:
        SceneError: the scene has mistakes.
        Trouble: a file cannot be written.
    """
    started, diagnostics = time.perf_counter(), job.diagnostics
    drawn = job.evaluation or ((job.scene,) if job.scene is not None else ())
    if diagnostics.errors or not drawn:
        raise SceneError(diagnostics)
    clip = Clip(drawn, diagnostics)
    numbers = clip.numbers(film.frames or FrameRange())
    if strict and diagnostics.items:
        raise SceneError(diagnostics)
    if outputs and target.kind != "sequence":
        what = f"`{out}` is one file; numbered pictures such as frame-%04d.png have outputs"
        raise click.UsageError(f"{what}.")
    check_outputs([target.file(number) for number in numbers], outputs)
    try:
        with Bar() as bar:
            result = make(
                Painter(clip, job.how, outputs=outputs), target, numbers, jobs=film.jobs,
                cluster=film.cluster, palette=film.palette, dither=film.dither, strict=strict,
                progress=lambda now: bar(now.told, now.done, now.total),
            )  # fmt: skip
    except KeyboardInterrupt:
        if target.work.exists():
            note = f"\nframes are kept in `{target.work}`; the same command goes on with the rest"
            click.echo(note, err=True)
        raise
    except OSError as error:
        raise Trouble(f"cannot write `{out}`: {describe(error)}") from None
    say_diagnostics(diagnostics)
    first, last = result.files[0], result.files[-1]
    name = f"{first} … {last.name}" if len(result.files) > 1 else str(first)
    parts = [plural(result.frames, "frame"), decimal(sum(file.stat().st_size for file in result.files))]
    if result.resumed:
        parts.append(f"{result.resumed} kept from a run before")
    if same := result.frames - result.drawn - result.resumed:
        parts.append(f"{same} the same as others")
    click.echo(f"{name}: {', '.join(parts)}, {time.perf_counter() - started:.1f} s", err=True)
    strays = {path.name for path in target.there()} if target.kind == "sequence" else set()
    if strays := strays - {file.name for file in result.files}:
        count, among = plural(len(strays), "such file"), " among them" if len(strays) > 1 else ""
        found = f"{count} of another run, `{min(strays)}`{among}"
        click.echo(f"note: `{target.path}` also holds {found}", err=True)
    for line in result.lines() if verbose else ():
        click.echo(f"  {line}", err=True)
