"""Scenes that the command line names, and options that several commands share."""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.assets.files import note_input
from scenelang.assets.records import Record
from scenelang.cli.say import Clock
from scenelang.drawing.how import CHOICES, DEFAULT, HELP, How
from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source, report_unreadable
from scenelang.language.library import SpanMap
from scenelang.language.limits import MAX_BYTES
from scenelang.language.scene import Scene
from scenelang.language.session import Defines, Unreadable, decode_source, read_source

if TYPE_CHECKING:
    from scenelang.compiler.graph import Graph
    from scenelang.compiler.program import Program


STDIN = "-"
JSON = ".json"


class Request(Record):
    """Options of the command line that hold for every scene."""

    source: Source  # all but its text; values for params are shared by all scenes
    frame: int | None = None  # of an animation, to be drawn as a picture

    def named(self) -> dict[str, Any]:
        """The same by the names that `scenelang.load` has for them."""
        given = self.source
        own = {"params": given.values, "model": given.model, "root": given.root, "size": given.size}
        return {**own, "frame": self.frame or 0}


class Input(Record, frozen=False):
    """A scene or a compiled program that the command line names, with its results so far."""

    name: str  # as the user wrote it
    how: How = DEFAULT  # how it is drawn
    diagnostics: Diagnostics = field(default_factory=Diagnostics)  # all so far
    trouble: str | None = None  # why a compiled program cannot be drawn
    tree: nodes.File | None = None  # None if it is not text
    evaluation: Evaluation | None = None  # runs its other frames; None for JSON
    scene: Scene | None = None  # None if it has errors
    spans: SpanMap = field(default_factory=SpanMap)  # where its nodes were written
    program: Program | None = None  # for the network
    # the graph after `lower` and each pass, in order
    graphs: dict[str, Graph] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)  # lines for `-v`

    def failed(self, strict: bool = False) -> bool:
        """True where there is nothing to draw."""
        return self.trouble is not None or any(d.severity == "error" or strict for d in self.diagnostics)


def stem_of(name: str) -> str:
    """The stem of names of files that are made from a scene."""
    return "stdin" if name == STDIN else Path(name).stem


def read_text(name: str, diagnostics: Diagnostics) -> SourceFile | None:
    """The text of a scene, None after a report that it is not text; raises `OSError` if it cannot be read."""
    try:
        if name == STDIN:
            note_input("/dev/stdin")  # which may be a file, by `<`
            return decode_source(sys.stdin.buffer.read(MAX_BYTES + 1), "<stdin>")
        return read_source(Path(name), name)
    except Unreadable as error:
        report_unreadable(name, error, diagnostics)
        return None


def read_input(
    name: str,
    request: Request,
    clock: Clock | None = None,
    how: How = DEFAULT,
    text: SourceFile | None = None,
) -> Input:
    """Read one scene: text is evaluated, JSON (by its suffix, or `{` first in standard input) just read.

    ``text`` is its text where that was read before. Raises `OSError` where it cannot be opened.
    """
    clock, result, frame = clock or Clock(), Input(name, how), request.frame or 0
    text = text or read_text(name, result.diagnostics)
    if text is None:
        return result
    path, root = (None, ".") if name == STDIN else (name, None)
    source = replace(request.source, path=path, text=text, root=request.source.root or root)
    if name.endswith(JSON) or (path is None and text.text.lstrip()[:1] == "{"):
        from scenelang.language.scene import load_json

        if frame:
            fact = f"frame {frame} of a scene from JSON, which is one frame"
            result.diagnostics.add("E0337", fact, None, help="convert that frame of the animation to JSON")
        with clock("read"):
            folder = Path(source.root or Path(name).parent)
            scene, spans = load_json(text, result.diagnostics, folder)
            if scene is not None and (source.size or source.model):
                changed = (scene if source.size is None else scene.sized(source.size)).of_model(source.model)
                if spans.span(scene) is not None:
                    spans.copy(scene, changed)
                scene = changed
    else:
        with clock("parse"):
            source = source.parsed(result.diagnostics)
        with clock("evaluate"):
            result.evaluation = source.evaluation(result.diagnostics, frame=frame, replays=True)
            scene, spans = result.evaluation.run(frame)
        result.tree = source.tree
    if scene is not None and not result.diagnostics.errors:
        result.scene, result.spans = scene, spans
    return result


def unused_defines(request: Request) -> list[Diagnostic]:
    """An error for every ``-D`` that no scene read so far has a param for."""
    result = Diagnostics()
    params = request.source.params
    if isinstance(params, Defines):
        params.report_unused(result)
    return result.items


def merged(parts: list[list[Diagnostic]]) -> Diagnostics:
    """All diagnostics; those of a file that several scenes import are reported once."""
    result = Diagnostics()
    for d in (d for part in parts for d in part):
        result.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
    return result


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
        result: dict[str, list[tuple[str, str]]] = {title: [] for title in ("Options", *self.sections)}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                result[heading.get(max(param.opts, key=len), "Options")].append(record)
        for title, records in result.items():
            with formatter.section(title):
                formatter.write_dl(records)


def _size(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int] | None:
    if value is None:
        return None
    result = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", value)
    if result is None:
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


def _defines(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> Defines:
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
