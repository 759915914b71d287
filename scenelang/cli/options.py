"""Options that several commands share."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.backend.options import CHOICES, HELP, How

if TYPE_CHECKING:
    from scenelang.evaluate.session import Defines

Color = Literal["auto", "always", "never"]


class Sectioned(click.Command):
    """A command whose help shows its options under headings.

    Args:
        sections: options by headings; the others come first.
    """

    def __init__(self, *arguments: Any, sections: Mapping[str, str], **given: Any) -> None:
        super().__init__(*arguments, **given)
        self.sections = sections

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        heading = {name: title for title, names in self.sections.items() for name in names.split()}
        found: dict[str, list[tuple[str, str]]] = {title: [] for title in ("Options", *self.sections)}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                found[heading.get(max(param.opts, key=len), "Options")].append(record)
        for title, records in found.items():
            with formatter.section(title):
                formatter.write_dl(records)


def _size(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int] | None:
    if value is None:
        return None
    found = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", value)
    if found is None:
        raise click.BadParameter(f"`{value}` is not a size such as 320x192", ctx, param)
    width, height = int(found[1]), int(found[2])
    if not (1 <= width <= 8192 and 1 <= height <= 8192):
        raise click.BadParameter(f"`{value}` has a side outside 1..8192", ctx, param)
    return width, height


def assignments(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> dict[str, str]:
    """What NAME=VALUE, given several times, says."""
    found: dict[str, str] = {}
    for value in values:
        name, equals, text = value.partition("=")
        if not equals or not re.fullmatch(r"[A-Za-z_][\w.]*", name.strip()):
            raise click.BadParameter(f"`{value}` is not NAME=value", ctx, param)
        found[name.strip()] = text.strip()
    return found


def _defines(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> Defines:
    from scenelang.evaluate.session import Defines

    return Defines(assignments(ctx, param, values))


def _originals(ctx: click.Context, param: click.Parameter, value: str | None) -> None:
    if value is not None:  # as every process that draws frames sees it
        os.environ["SCENELANG_ORIGINALS"] = value


def choice(*names: str, words: str, help: str) -> Callable[..., Any]:
    """An option that takes one of some words, the first of them by default."""
    known = words.split()
    return click.option(*names, type=click.Choice(known), default=known[0], show_default=True, help=help)


class Real(click.FloatRange):
    """A number in a range, within whose bounds `nan` would be too."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"`{value}` is not a number.", param, ctx)
        return number


define = click.option(
    "-D",
    "defines",
    multiple=True,
    metavar="NAME=VALUE",
    callback=_defines,
    help="Set a param of the scene; may be given several times.",
)
model = click.option("--model", metavar="NAME", help="Use this model instead of the scene's.")
root = click.option(
    "--root",
    type=click.Path(exists=True, file_okay=False),
    help="Folder that imports cannot leave; by default the scene's.",
)
size = click.option(
    "--size", metavar="WxH", callback=_size, help="Canvas size in pixels instead of the scene's."
)
frame = click.option(
    "--frame",
    type=click.IntRange(0),
    metavar="N",
    help="Frame of the animation, from 0; as a picture, which is drawn alone.",
)
frames = click.option(
    "--frames",
    metavar="A..B",
    help="Frames of an animation to draw: 0..23, 0..<24, 12.. to the end, or 7.",
)
fps = click.option(
    "--fps",
    type=Real(0, 1000, min_open=True),
    metavar="N",
    help="Frames a second instead of the scene's; the length in seconds stays.",
)
out = click.option("-o", "--out", metavar="OUT", help="File to write instead of standard output.")
color = choice(
    "--color",
    words="auto always never",
    help="Colour what is printed; auto does so on terminals, unless NO_COLOR is set.",
)
strict = click.option("--strict", is_flag=True, help="Count warnings as errors.")
originals = click.option(
    "--originals",
    type=click.Path(exists=True, file_okay=False),
    metavar="FOLDER",
    expose_value=False,
    callback=_originals,
    help="Folder with the files that elements were made from, which exact pictures need; by "
    "default that of the elements.",
)
jobs = click.option(
    "--jobs",
    type=click.IntRange(1, 256),
    metavar="N",
    help="Processes that draw frames; by default one, and more where that is faster.",
)
cluster = click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Address of a dask scheduler whose workers do the work, or local for workers on this machine.",
)
verbose = click.option("-v", "--verbose", is_flag=True, help="Say what was compiled and where the time went.")


def request(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options to read scenes by, -D, --size, --frame, --model and --root, handed over as a `Request`."""

    @define
    @size
    @frame
    @model
    @root
    @wraps(command)
    def with_request(*arguments: Any, **given: Any) -> Any:
        from scenelang.cli.inputs import Request
        from scenelang.evaluate.evaluation import Source

        frame, params = given.pop("frame"), given.pop("defines")
        own = {name: given.pop(name) for name in ("model", "root", "size")}
        return command(*arguments, request=Request(Source(params=params, **own), frame), **given)

    return with_request


def _field(name: str) -> Callable[..., Any]:
    """The option for a field of `How`."""
    if name in CHOICES:
        return choice(f"--{name}", words=" ".join(CHOICES[name]), help=HELP[name])
    return click.option(f"--{name}", type=click.IntRange(1), metavar="N", help=HELP[name])


device, threads = _field("device"), _field("threads")


def drawing(*names: str) -> Callable[..., Any]:
    """Options for these fields of `How`, all by default, handed over as ``how``."""
    fields = names or How._fields

    def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def with_how(*arguments: Any, **given: Any) -> Any:
            how = How(**{name: given.pop(name) for name in fields})
            return command(*arguments, how=how.checked(), **given)

        for name in reversed(fields):
            with_how = _field(name)(with_how)
        return with_how

    return with_options
