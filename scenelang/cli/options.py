"""Options that several commands share, and values that commands get of them; imports nothing heavy."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.assets.records import Record
from scenelang.cli.files import stem_of, streamed
from scenelang.drawing.how import CHOICES, HELP, How

if TYPE_CHECKING:
    from scenelang.language.evaluation import Source
    from scenelang.output.encoders import Palette
    from scenelang.output.frames import FrameRange, Target

Color = Literal["auto", "always", "never"]
Option = Callable[..., Any]  # a decorator of commands


class Request(Record):
    """Options that hold for every scene of a command."""

    source: Source  # all but its text; values for params are shared by all scenes
    frame: int | None = None  # of an animation, to be drawn as a picture


class FilmOptions(Record):
    """Options for animations alone."""

    frames: FrameRange | None = None  # None for all
    fps: float | None = None  # frames a second instead of the scene's
    jobs: int | None = None  # processes that draw
    cluster: str | None = None  # whose workers draw
    # of a GIF
    palette: Palette = "auto"
    dither: bool = False

    @property
    def certain(self) -> bool:
        """True where the output has to be an animation."""
        return self.frames is not None or self.fps is not None

    def target(self, name: str, out: str) -> Target | None:
        """The target of a scene's animation; None where ``out`` is a single picture.

        Raises `click.UsageError` where it is one and frames are asked for.
        """
        from scenelang.output.frames import TargetError, find_target, is_animation

        if not (is_animation(out) or out.endswith(("/", "\\")) or Path(out).is_dir() or self.certain):
            return None
        try:
            return find_target(out, stem_of(name))
        except TargetError as error:
            raise click.UsageError(f"{error}.") from None


class Sectioned(click.Command):
    """A command whose help shows its options under the headings of ``sections``; the others come first."""

    def __init__(self, *arguments: Any, sections: Mapping[str, str], **given: Any) -> None:
        super().__init__(*arguments, **given)
        self.sections = sections

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        heading = {name: title for title, names in self.sections.items() for name in names.split()}
        result: dict[str, list[tuple[str, str]]] = {title: [] for title in ("Options", *self.sections)}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                result[heading.get(max(param.opts, key=len), "Options")].append(record)
        for title, records in result.items():
            with formatter.section(title):
                formatter.write_dl(records)


def text(name: str, metavar: str, help: str, **more: Any) -> Option:
    """An option that takes a text, or what its callback makes of that."""
    return click.option(name, metavar=metavar, help=help, **more)


def writes(metavar: str, help: str, suffix: str | None = None, *, required: bool = True) -> Option:
    """The option that says where a command writes to; files of the suffix go to standard output too."""

    def place(ctx: click.Context, param: click.Parameter, out: str | None) -> str | None:
        given = ctx.params.get("format")
        if suffix is None or out is None:
            return out
        file = streamed(ctx, out, f".{given}" if given else suffix)
        if given and file == out:
            raise click.UsageError(f"--format is for standard output; `{out}` says its format by its suffix.")
        return file

    return click.option("-o", "--out", required=required, metavar=metavar, help=help, callback=place)


def choice(*names: str, words: str, help: str) -> Option:
    """An option that takes one of some words, the first of them by default."""
    known = words.split()
    return click.option(*names, type=click.Choice(known), default=known[0], show_default=True, help=help)


def count(*names: str, low: int = 1, high: int | None = None, metavar: str = "N", **more: Any) -> Option:
    """An option that takes a whole number in a range."""
    return click.option(*names, type=click.IntRange(low, high), show_default=True, metavar=metavar, **more)


class Real(click.FloatRange):
    """A number in a range, within whose bounds `nan` would be too."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"`{value}` is not a number.", param, ctx)
        return number


def positive(name: str, metavar: str, help: str, *, high: float | None = None, default: Any = None) -> Option:
    """An option that takes a number above 0."""
    kind = Real(0, high, min_open=True)
    return click.option(name, type=kind, default=default, show_default=True, metavar=metavar, help=help)


def several(*names: str, of: tuple[str, ...], help: str) -> Option:
    """An option that takes one of some words, and may be given several times."""
    help += "; may be given several times."
    return click.option(*names, multiple=True, type=click.Choice(of), help=help)


def _size(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int] | None:
    if value is None:
        return None
    if (result := re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", value)) is None:
        raise click.BadParameter(f"`{value}` is not a size such as 320x192", ctx, param)
    width, height = int(result[1]), int(result[2])
    if not (1 <= width <= 8192 and 1 <= height <= 8192):
        raise click.BadParameter(f"`{value}` has a side outside 1..8192", ctx, param)
    return width, height


def assignments(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> dict[str, str]:
    """A dictionary from an option NAME=VALUE that may be given several times."""
    result: dict[str, str] = {}
    for value in values:
        name, equals, text = value.partition("=")
        if not equals or not re.fullmatch(r"[A-Za-z_][\w.]*", name.strip()):
            raise click.BadParameter(f"`{value}` is not NAME=value", ctx, param)
        result[name.strip()] = text.strip()
    return result


def _frames(ctx: click.Context, param: click.Parameter, value: str | None) -> FrameRange | None:
    if value is None:
        return None
    from scenelang.output.frames import FrameRange, FramesError

    try:
        return FrameRange.parse(value)
    except FramesError as error:
        raise click.BadParameter(str(error), ctx, param) from None


def _originals(ctx: click.Context, param: click.Parameter, value: str | None) -> None:
    if value is not None:  # as every process that draws frames sees it
        os.environ["SCENELANG_ORIGINALS"] = value


define = click.option(
    "-D", "defines", multiple=True, metavar="NAME=VALUE", callback=assignments,
    help="Set a param of the scene; may be given several times.",
)  # fmt: skip
model = click.option("--model", metavar="NAME", help="Use this model instead of the scene's.")
_FOLDER = click.Path(exists=True, file_okay=False)
root = click.option("--root", type=_FOLDER, help="Folder that imports cannot leave; by default the scene's.")
size = click.option(
    "--size", metavar="WxH", callback=_size, help="Canvas size in pixels instead of the scene's."
)
frame = count("--frame", low=0, help="Frame of the animation, from 0; as a picture, which is drawn alone.")
out = click.option("-o", "--out", metavar="OUT", help="File to write instead of standard output.")
color = choice(
    "--color",
    words="auto always never",
    help="Colour what is printed; auto does so on terminals, unless NO_COLOR is set.",
)
strict = click.option("--strict", is_flag=True, help="Count warnings as errors.")
originals = click.option(
    "--originals", type=_FOLDER, metavar="FOLDER", expose_value=False, callback=_originals,
    help="Folder with the files that elements were made from, which exact pictures need; by "
    "default that of the elements.",
)  # fmt: skip
jobs = count(
    "--jobs", high=256, help="Processes that draw frames; by default one, and more where that is faster."
)
cluster = click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Address of a dask scheduler whose workers do the work, or local for workers on this machine.",
)
verbose = click.option("-v", "--verbose", is_flag=True, help="Say what was compiled and where the time went.")


def _bundle(into: str, build: Callable[..., Any], options: Mapping[str, Option], *names: str) -> Option:
    """Some of these options, by default all, as one argument: ``build`` makes it of their values by name."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def bundled(*arguments: Any, **given: Any) -> Any:
            own = {name: given.pop(name) for name in names or options}
            return command(*arguments, **{into: build(**own)}, **given)

        for name in reversed(names or tuple(options)):
            bundled = options[name](bundled)
        return bundled

    return decorate


def _requested(defines: Mapping[str, str], frame: int | None, **own: Any) -> Request:
    from scenelang.language.evaluation import Source
    from scenelang.language.session import Defines

    return Request(Source(params=Defines(defines), **own), frame)


def field(name: str) -> Option:
    """The option for a field of `How`."""
    if How._field_defaults[name] is False:
        return click.option(f"--{name}", is_flag=True, help=HELP[name])
    if name in CHOICES:
        return choice(f"--{name}", words=" ".join(CHOICES[name]), help=HELP[name])
    return count(f"--{name}", help=HELP[name])


# Each of these gives all its options, or those that it names, as one argument.
request = partial(
    _bundle,
    "request",  # a `Request`
    _requested,
    {"defines": define, "size": size, "frame": frame, "model": model, "root": root},
)
drawing = partial(
    _bundle,
    "how",  # a `How`
    lambda **own: How(**own).checked(),
    {name: field(name) for name in How._fields},
)
film = partial(
    _bundle,
    "film",  # a `FilmOptions`
    FilmOptions,
    {
        "frames": text(
            "--frames",
            "A..B",
            "Frames of an animation to draw: 0..23, 0..<24, 12.. to the end, or 7.",
            callback=_frames,
        ),
        "fps": positive(
            "--fps", "N", "Frames a second instead of the scene's; the length in seconds stays.", high=1000
        ),
        "jobs": jobs,
        "cluster": cluster,
        "palette": choice(
            "--palette", words="auto global frame", help="Colours of a GIF: 255 for all frames or for each."
        ),
        "dither": click.option("--dither", is_flag=True, help="Dither colours that a GIF's palette lacks."),
    },
)
