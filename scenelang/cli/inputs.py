"""Scenes and compiled programs that the command line names, read, evaluated and compiled, and how to draw."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.assets.files import note_input
from scenelang.assets.records import Record
from scenelang.cli.files import PROGRAM, STDIN
from scenelang.cli.main import describe
from scenelang.cli.options import Request
from scenelang.cli.say import Clock, say_diagnostics, say_trouble
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.how import DEFAULT, How
from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, report_unreadable
from scenelang.language.library import SpanMap
from scenelang.language.limits import MAX_BYTES
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene
from scenelang.language.session import Defines, Unreadable, decode_source, read_source
from scenelang.language.words import COMBINE

if TYPE_CHECKING:
    from scenelang.compiler.graph import Graph
    from scenelang.compiler.program import Program
    from scenelang.output.frontier import Limits, Point


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
    if (text := text or read_text(name, result.diagnostics)) is None:
        return result
    path, root = (None, ".") if name == STDIN else (name, None)
    source = replace(request.source, path=path, text=text, root=request.source.root or root)
    if name.endswith(".json") or (path is None and text.text.lstrip()[:1] == "{"):
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
    if isinstance(params := request.source.params, Defines):
        params.report_unused(result)
    return result.items


def merged(parts: list[list[Diagnostic]]) -> Diagnostics:
    """All diagnostics; those of a file that several scenes import are reported once."""
    result = Diagnostics()
    for d in (d for part in parts for d in part):
        result.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
    return result


def compile_input(job: Input, request: Request, clock: Clock, graphs: bool = False) -> None:
    """Compile a scene without errors that the reference does not draw; raises `OSError` without weights."""
    if job.scene is None or job.how.backend == "reference":
        return
    from scenelang.compiler.compile import why_chosen

    with suppress(SceneError), clock("compile"):  # its diagnostics are the input's
        after = job.graphs.__setitem__ if graphs else None
        job.program = compile_scene(job.scene, spans=job.spans, diagnostics=job.diagnostics, after=after)
        job.notes = program_notes(job.program, why_chosen(job.scene, request.source.model is not None))


def prepare_all(
    files: Sequence[str],
    request: Request,
    clock: Clock,
    how: How = DEFAULT,
    *,
    strict: bool = False,
    graphs: bool = False,
    stored: str | None = None,
    first: Input | None = None,
) -> tuple[list[Input | None], int]:
    """Every input read and compiled, None where it cannot be read, after a report of mistakes.

    And the exit code so far: 1 where a scene has mistakes, 2 where a file cannot be read. ``stored`` is why
    compiled programs are refused, if they are; ``first`` the only input, where it was read before.
    """
    inputs: list[Input | None] = []
    code = 0
    for name in files:
        try:
            if name.endswith(PROGRAM):
                result = _stored(name, request, clock, how)
                result.trouble = stored or result.trouble
            else:
                result = first or read_input(name, request, clock, how)
                compile_input(result, request, clock, graphs)
        except OSError as error:
            say_trouble(describe(error))
            inputs.append(None)
            code = 2
            continue
        if result.trouble is not None:
            say_trouble(f"{name}: {result.trouble}")
        inputs.append(result)
    read = [result for result in inputs if result is not None]
    unused = unused_defines(request) if read else []
    say_diagnostics(merged([*(result.diagnostics.items for result in read), unused]))
    if unused:
        return [None] * len(inputs), max(code, 1)
    return inputs, max(code, int(any(result.failed(strict) for result in read)))


def prepare_scene(name: str, request: Request, clock: Clock | None = None) -> Input:
    """Compile the one scene of a command, keep its graphs and report its mistakes.

    Raises `OSError` where it cannot be read or a model has no weights, `click.UsageError` for a program.
    """
    if name.endswith(PROGRAM):
        raise click.UsageError(f"`{name}` is a compiled program already.")
    clock = clock or Clock()
    result = read_input(name, request, clock)
    compile_input(result, request, clock, graphs=True)
    result.diagnostics.items.extend(unused_defines(request))
    say_diagnostics(result.diagnostics)
    return result


def _stored(name: str, request: Request, clock: Clock, how: How) -> Input:
    """A compiled program."""
    from scenelang.compiler.program import ProgramError, load_program

    result, size, model = Input(name, how), request.source.size, request.source.model
    try:
        with clock("load program"):
            program = load_program(Path(name))
    except ProgramError as error:
        result.trouble = str(error)
        return result
    if model not in (None, program.model):
        result.trouble = f"compiled for model `{program.model}`, not `{model}`"
    elif request.frame:
        result.trouble = f"a program is a single frame, and --frame asks for {request.frame}"
    elif size is not None:
        (width, height), (old_width, old_height) = size, program.canvas
        if width * old_height != height * old_width:
            old = f"the {old_width}x{old_height} it was compiled for"
            advice = "objects outside it are gone: compile the scene again"
            result.trouble = f"{width}x{height} has another shape than {old}; {advice}"
        program = replace(program, canvas=size)
    result.program, result.notes = program, program_notes(program, "named by the program")
    return result


def program_notes(program: Program, why: str) -> list[str]:
    """Lines about a compiled scene."""
    from scenelang.compiler.groups import OPERATOR

    shapes = ", ".join(f"{number} {name}" for name, number in Counter(program.objects).items())
    tokens = sorted(Counter((program.tokens & OPERATOR).tolist()).items())
    width, height = program.canvas
    return [
        f"{width} x {height} pixels, model {program.model} ({why}), weights {program.weights[:12]}",
        f"objects: {len(program)}" + (f" ({shapes})" if shapes else ""),
        "tokens: " + (", ".join(f"{number} {COMBINE[token]}" for token, number in tokens) or "none"),
    ]


def choose_all(jobs: list[Input], limits: Limits, model: str | None) -> list[Input]:
    """Choose how to draw, by ``model`` alone where it is given; return the jobs that fit and report others.

    Raises `click.UsageError` where an option says what the frontier decides.
    """
    from scenelang.output import frontier

    for job in jobs:
        if (
            job.how._replace(threads=None, device="auto", patient=False) != DEFAULT
            or job.how.device == "cuda"
        ):
            asked = "--max-ms" if limits.ms is not None else "--max-flip"
            other = "--device cuda" if job.how.device == "cuda" else "--backend and --samples"
            raise click.UsageError(f"{asked} chooses how to draw on processors; leave out {other}.")
    here_ms, able = frontier.yardstick(), []
    for job in jobs:
        try:
            _choose(job, limits, model, here_ms)
            able.append(job)
        except frontier.NothingFits as error:
            say_trouble(f"{job.name}: {error}")
    return able


def _choose(job: Input, limits: Limits, model: str | None, here_ms: float) -> None:
    """The best choice whose model draws a job's scene without further warnings; raises `NothingFits`."""
    from scenelang.drawing.work import load_of
    from scenelang.output import frontier

    program = job.program
    assert program is not None
    try:
        measured = frontier.load_frontier(program.model)
    except ValueError as error:
        raise frontier.NothingFits(f"the frontier of `{program.model}` is damaged: {error}") from None
    if measured is None:
        raise frontier.NothingFits(f"model `{program.model}` ships no frontier to choose from")
    reasons = {point.name: frontier.refusal(point, job.scene, program, model) for point in measured.points}
    # those that are not offered are for charts only
    refused = {p.name: why for p in measured.points if (why := reasons[p.name]) is not None and p.offered}
    able = [point for point in measured.points if reasons[point.name] is None]
    scale = frontier.machine_scale(measured, here_ms)
    result = frontier.offers(able, load_of(program), program.canvas, scale)
    while True:
        offer, notes = frontier.choose(result, limits, refused)
        point, compiled = offer.point, _compiled(job, program, offer.point)
        if not isinstance(compiled, str):
            break
        refused |= {o.point.name: compiled for o in result if o.point.model == point.model}
        result = [offer for offer in result if offer.point.model != point.model]
    samples = point.samples if point.backend == "neural" else "adaptive"
    job.program, job.how = compiled, How(point.backend, "auto", job.how.threads, samples, job.how.patient)
    speed = f"this machine takes {scale:.2f} times as long as the one that was measured"
    like = f"errors are promised for scenes like those of the set `{measured.set}`"
    like += ", which have no elements" if job.scene is not None and job.scene.elements else ""
    others = [f"not in question: {name}: {why}" for name, why in refused.items()]
    own = program_notes(compiled, "chosen by the frontier") if point.backend == "neural" else []
    job.notes = [*notes, f"times are for one thread; {speed}", like, *others, *own]


def _compiled(job: Input, program: Program, point: Point) -> Program | str:
    """The Program for a point's model; the reason where it cannot draw the scene as promised."""
    if point.model in (None, program.model):
        return program
    assert job.scene is not None
    result = Diagnostics()
    try:
        compiled = compile_scene(job.scene, spans=job.spans, diagnostics=result, model=point.model)
    except SceneError:
        return result.errors[0].message
    known = {d.code for d in job.diagnostics}
    # a warning that the scene's own model does not give: this one is outside what it was trained on
    return next((d.message for d in result.items if d.code not in known), compiled)
