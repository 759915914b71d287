"""``scenelang watch``: a scene drawn again whenever it is saved."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scenelang.cli import options
from scenelang.cli.files import composed, targets
from scenelang.cli.main import describe
from scenelang.cli.say import wants_color
from scenelang.drawing.how import How, RenderError
from scenelang.language.diagnostics import plural

if TYPE_CHECKING:
    import PIL.Image

    from scenelang.output.watch import Easel, Outcome, Screen


@click.command("watch")
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE")
@click.option("-o", "--out", metavar="OUT", help="Picture or animation to write; by default STEM.png.")
@options.request()
@options.film("frames", "fps")
@options.choice(
    "--show",
    words="auto never always",
    help="Show the picture in the terminal; always does with coloured characters if need be.",
)
@options.drawing()
def command(
    file: Path,
    out: str | None,
    request: options.Request,
    film: options.FilmOptions,
    how: How,
    show: Literal["auto", "never", "always"],
) -> None:
    """Draw a scene again whenever it, or a file that it imports, is saved.

    OUT is always written, whole; where solids take long it holds a coarse draft until the picture is drawn,
    which a further save calls off. Mistakes stay on the screen until they are mended, and OUT stays the last
    good picture. Where OUT is an animation, all of it is drawn again. Ctrl-C ends it, with exit code 130.
    """
    from scenelang.output.frames import FrameRange
    from scenelang.output.watch import Easel, Outdated, Screen, settle, stamps, wait

    out = str(composed(Path(f"{file.stem}.png"))) if out is None else out
    target = film.target(str(file), out) if request.frame is None else None
    path = Path(out) if target is not None else targets([str(file)], out)[0]
    if not file.is_file():
        raise click.UsageError(f"there is no file `{file}`.")
    source = replace(request.source, path=file, fps=film.fps, params=request.source.values)
    screen = Screen(show, wants_color(sys.stdout))
    easel = Easel(source, path, target, film.frames or FrameRange(), request.frame or 0, how)
    easel.drafted = partial(_report, easel, screen)
    while True:
        before = stamps(easel.paths)
        try:
            outcome = easel.draw(before)
        except Outdated:
            settle(easel.paths)
            continue
        except (OSError, RenderError) as error:
            gone = isinstance(error, FileNotFoundError) and error.filename
            said = f"Error: {describe(error) if isinstance(error, OSError) else error}"
            if gone and Path(gone) == easel.file:
                said = f"{easel.file} is gone; waiting for it"
            screen.clear()
            screen.say(f"{time.strftime('%H:%M:%S')} {said}")
        else:
            _report(easel, screen, outcome)
        # what changed since it was read, even before it was known to be read, is drawn at once
        wait({path: before[path] if path in before else easel.seen[path] for path in easel.paths})


def _report(easel: Easel, screen: Screen, outcome: Outcome) -> None:
    clock = time.strftime("%H:%M:%S")
    screen.clear()
    if outcome.diagnostics:
        screen.say_diagnostics(outcome.diagnostics)
    if outcome.good:
        screen.say(f"{clock} {_told(outcome, easel.out)}")
        if screen.shows and (picture := _shown(outcome)) is not None:
            screen.show(picture)
    else:
        errors = sum(d.severity == "error" for d in outcome.diagnostics)
        stays = f"; {easel.out} stays as it was" if easel.out.exists() else ""
        screen.say(f"{clock} {easel.file}: {plural(errors, 'error')}{stays}")


def _shown(outcome: Outcome) -> PIL.Image.Image | None:
    """The picture, or the first one of an animation."""
    if outcome.image is not None:
        return outcome.image.to_pil()
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(outcome.files[0]) as film:
            return film.convert("RGBA")
    except UnidentifiedImageError:
        return None  # video


def _told(outcome: Outcome, out: Path) -> str:
    """A line about a drawing that is good."""
    if outcome.same:
        return f"{out}: the same picture ({1000 * outcome.seconds['compile']:.0f} ms)"
    name = f"{outcome.files[0]}{' (draft)' * outcome.draft}"
    if len(outcome.files) > 1:
        name = f"{name} … {outcome.files[-1].name}"
    told = ", ".join(f"{step} {1000 * seconds:.0f}" for step, seconds in outcome.seconds.items())
    return f"{name}: {1000 * sum(outcome.seconds.values()):.0f} ms ({told})"
