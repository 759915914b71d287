"""From an input of the command line to something a backend draws."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.backend.options import DEFAULT, How
from scenelang.cli.inputs import Input, Request, merged, read_input, unused_defines
from scenelang.cli.main import describe
from scenelang.cli.progress import Clock
from scenelang.cli.say import say_diagnostics, say_trouble
from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import plural
from scenelang.graph.nodes import Graph, Leaf, nodes
from scenelang.models.choose import why_chosen
from scenelang.passes import PASSES
from scenelang.program.compile import compile_scene

if TYPE_CHECKING:
    from scenelang.program.program import Program
    from scenelang.scene.schema import Scene

PROGRAM = ".safetensors"
STAGES = ("syntax", "scene", "lower", *(step.name for step in PASSES), "program")
"""Of the compiler, in order: the syntax tree, the scene, the graph after each pass, the program."""


def check_stages(wanted: Collection[str], known: Collection[str] = STAGES) -> None:
    """Raise `click.UsageError` for names that are none of the stages."""
    for name in wanted:
        if name not in known:
            from difflib import get_close_matches

            near = get_close_matches(name, known, 1)
            advice = f" Did you mean `{near[0]}`?" if near else ""
            raise click.UsageError(f"No stage `{name}`.{advice} There are {', '.join(known)}.")


@dataclass(slots=True)
class Job:
    """One input, ready to be drawn or with the reason why not."""

    name: str  # as the user wrote it
    how: How = DEFAULT  # how it is drawn
    source: Input | None = None  # the scene, where there is one
    trouble: str | None = None  # why a compiled program cannot be drawn
    program: Program | None = None  # what the network draws
    # the graph after `lower` and each pass, in order
    graphs: dict[str, Graph] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)  # what to say about it on `-v`

    @property
    def diagnostics(self) -> list[Diagnostic]:
        """What was found in a scene."""
        return self.source.diagnostics.items if self.source is not None else []

    @property
    def scene(self) -> Scene | None:
        """The scene, where there is one without errors."""
        return self.source.scene if self.source is not None else None

    def failed(self, strict: bool = False) -> bool:
        """Whether there is nothing to draw."""
        return self.trouble is not None or any(d.severity == "error" or strict for d in self.diagnostics)


def compiled(job: Job, request: Request, clock: Clock, graphs: bool = False) -> None:
    """Compile the scene of a job, if it has one and is not drawn by the reference; ``graphs`` are kept.

    Raises:
        OSError: a model has no weights.
    """
    found, model = job.source, request.source.model
    if found is None or found.scene is None or job.how.backend == "reference":
        return
    with suppress(SceneError), clock("compile"):  # its diagnostics are the input's
        job.program = compile_scene(
            found.scene,
            spans=found.spans,
            diagnostics=found.diagnostics,
            model=model,
            after=job.graphs.__setitem__ if graphs else None,
        )
        why = why_chosen(found.scene, model is not None)
        job.notes = [*program_notes(job.program, why), *_pass_notes(job.graphs)]


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
) -> tuple[list[Job | None], int]:
    """Every input read and compiled, None where it cannot be read; reports mistakes.

    Args:
        how: how they are drawn.
        strict: warnings count as errors.
        graphs: keep the graphs, and make notes of what the passes did.
        stored: why compiled programs are refused, if they are.
        first: the only one, where it was read before.

    Returns:
        The jobs, and the exit code so far: 1 where a scene has mistakes, 2 where a file cannot be read.
    """
    jobs: list[Job | None] = []
    code = 0
    for name in files:
        try:
            if name.endswith(PROGRAM):
                job = _stored(name, request, clock, how)
                job.trouble = stored or job.trouble
            else:
                job = Job(name, how, first or read_input(name, request, clock))
                compiled(job, request, clock, graphs)
        except OSError as error:
            say_trouble(describe(error))
            jobs.append(None)
            code = 2
            continue
        if job.trouble is not None:
            say_trouble(f"{name}: {job.trouble}")
        jobs.append(job)
    read = [job for job in jobs if job is not None]
    unused = unused_defines(request) if read else []
    say_diagnostics(merged([*(job.diagnostics for job in read), unused]))
    if unused:
        return [None] * len(jobs), max(code, 1)
    return jobs, max(code, int(any(job.failed(strict) for job in read)))


def prepare_scene(name: str, request: Request, clock: Clock | None = None) -> tuple[Job, Input]:
    """Compile the one scene of a command, keep its graphs and report its mistakes.

    Raises:
        OSError: it cannot be read, or a model has no weights.
        click.UsageError: it is a compiled program.
    """
    if name.endswith(PROGRAM):
        raise click.UsageError(f"`{name}` is a compiled program already.")
    clock = clock or Clock()
    found = read_input(name, request, clock)
    job = Job(name, source=found)
    compiled(job, request, clock, graphs=True)
    job.diagnostics.extend(unused_defines(request))
    say_diagnostics(job.diagnostics)
    return job, found


def _stored(name: str, request: Request, clock: Clock, how: How) -> Job:
    from scenelang.program.program import ProgramError
    from scenelang.program.reading import load_program

    job, size, model = Job(name, how), request.source.size, request.source.model
    try:
        with clock("load program"):
            program = load_program(Path(name))
    except ProgramError as error:
        job.trouble = str(error)
        return job
    if model not in (None, program.model):
        job.trouble = f"compiled for model `{program.model}`, not `{model}`"
    elif request.frame:
        job.trouble = f"a program is a single frame, and --frame asks for {request.frame}"
    elif size is not None:
        (width, height), (old_width, old_height) = size, program.canvas
        if width * old_height != height * old_width:
            old = f"the {old_width}x{old_height} it was compiled for"
            advice = "objects outside it are gone: compile the scene again"
            job.trouble = f"{width}x{height} has another shape than {old}; {advice}"
        program = replace(program, canvas=size)
    job.program, job.notes = program, program_notes(program, "named by the program")
    return job


def program_notes(program: Program, why: str) -> list[str]:
    """Lines about a compiled scene."""
    from scenelang.program.groups import OPERATOR
    from scenelang.words import COMBINE

    shapes = Counter(program.objects)
    words = Counter((program.tokens & OPERATOR).tolist())
    width, height = program.canvas
    return [
        f"{width} x {height} pixels, model {program.model} ({why}), weights {program.weights[:12]}",
        f"objects: {len(program)}" + _counts(shapes),
        "tokens: " + (_counts({COMBINE[t]: n for t, n in sorted(words.items())})[2:-1] or "none"),
    ]


def _counts(counts: dict[str, int]) -> str:
    """`` (2 star, 1 square)``, or nothing."""
    listed = ", ".join(f"{number} {name}" for name, number in counts.items())
    return f" ({listed})" if listed else ""


def _pass_notes(graphs: dict[str, Graph]) -> Iterator[str]:
    """A line for each pass that changed the number of objects, folds or moves."""
    before = None
    for name, graph in graphs.items():
        found = list(nodes(graph.root))
        objects = sum(isinstance(node, Leaf) for node in found)
        counts = (objects, len(found) - objects, sum(len(node.moves) for node in found))
        if counts != before:
            told = ", ".join(map(plural, counts, ("object", "fold", "move")))
            yield f"{name if before else 'as written'}: {told}"
        before = counts
