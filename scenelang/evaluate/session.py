"""What one evaluation shares: diagnostics, spans, limits and counters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from scenelang.diagnostics.diagnostic import Diagnostics, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import Effort
from scenelang.evaluate.names import UNBOUND, Needs
from scenelang.evaluate.report.suppression import NONE, Damage
from scenelang.evaluate.values.value import Problem
from scenelang.evaluate.vocabulary import Vocabulary
from scenelang.scene import library
from scenelang.scene.schema import Animation
from scenelang.scene.spans import Calls, SpanMap
from scenelang.syntax import nodes

if TYPE_CHECKING:
    from scenelang.evaluate.report.bad_calls import Misfit
    from scenelang.evaluate.report.type_errors import Shared

MAX_OBJECTS: Final = 100_000
MAX_PARTS: Final = 1_000_000  # nodes, transforms and texture operations together; bounds memory
MAX_DEPTH: Final = 200  # calls within calls
MAX_NESTING: Final = 250  # tree levels; text never has as many, trees made by hand can
MAX_STEPS: Final = 10_000_000
MAX_BYTES: Final = 10_000_000
MAX_COMPARED: Final = 500_000  # letters of names, to suggest one

Watch = Callable[[Span, Any], None]
"""What an editor looks on with; it may raise `Halt` to end the evaluation."""


class Halt(Exception):
    """A limit was met and reported; the evaluation ends."""


@dataclass(slots=True)
class Settings:
    """What the top level sets, and where each was given.

    Args:
        canvas: width and height in pixels.
        background: colour as written, or None for transparency.
        animation: the scene's animation, if it has one.
        given: the place of each setting, by its word.
    """

    canvas: tuple[int, int] = (256, 256)
    background: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
    animation: Animation | None = None
    given: dict[str, Span] = field(default_factory=dict)


@dataclass(slots=True)
class Session:
    """The state of one evaluation over all its files.

    Args:
        diagnostics: where mistakes go.
        vocabulary: names that models offer.
        expressions, statements: how each class of the syntax tree is prepared.
        frame: number of the frame to evaluate.
        fps: frames a second instead of those that ``animate`` names.
        replays: run what no frame changes once; the evaluation is for several frames.
        roots: the live slots of every file.
        needs: collects what the statement being prepared depends on.
        watch: called with the place of each name and its value, and of each statement and its node.
    """

    diagnostics: Diagnostics
    vocabulary: Vocabulary
    expressions: Mapping[type, Callable[..., Any]]
    statements: Mapping[type, Callable[..., Any]]
    frame: int = 0
    fps: float | None = None
    spans: SpanMap = field(default_factory=SpanMap)
    steps: int = 0
    objects: int = 0
    parts: int = 0
    depth: int = 0
    node_depth: int = 0
    calls: Calls | None = None
    animated: list[Any] = field(default_factory=lambda: [UNBOUND] * 4)
    settings: Settings = field(default_factory=Settings)
    damaged: dict[int, Damage] = field(default_factory=dict)
    reported: dict[tuple[int, int, int], str] = field(default_factory=dict)
    blamed: dict[tuple[int, int, str], Shared] = field(default_factory=dict)
    """Reports of values of the wrong kind, by the definitions they may come from and what is said."""
    unknown: dict[tuple[str, str, int], tuple[int, tuple[Label, ...], dict[Span, None]]] = field(
        default_factory=dict
    )
    """Reports of unknown names: index, labels of their own, further places."""
    told: set[tuple[str, str, int]] = field(default_factory=set)
    """Unknown names that were reported where a definition has the slip."""
    effort: Effort = field(default_factory=lambda: Effort(MAX_COMPARED))
    shared: dict[tuple[str | int, ...], tuple[int, dict[Span, None]]] = field(default_factory=dict)
    """Other reports that several places share, by what they have in common: index, further places."""
    blocks: list[Any] = field(default_factory=list)
    """The blocks with such reports."""
    misfits: dict[int, tuple[nodes.Fn | nodes.Module, dict[Span, Misfit]]] = field(default_factory=dict)
    """Calls that do not fit by what they call and where, until they are reported."""
    names_in: dict[int, dict[str, list[Span]]] = field(default_factory=dict)
    replays: bool = False
    roots: list[list[Any]] = field(default_factory=list)
    needs: Needs = field(default_factory=Needs)
    defined: dict[tuple[int, int], Span] = field(default_factory=dict)
    """Where variables and functions are defined, by the file and place of each use."""
    origins: dict[tuple[int, int], nodes.Expr] = field(default_factory=dict)
    """The values of lets and the bodies of functions, by the file and place of their names."""
    parameters: dict[tuple[int, int], tuple[int, int]] = field(default_factory=dict)
    """What a parameter belongs to, as a key of ``given``, and its index; by its file and place."""
    given: dict[int, list[list[nodes.Argument | None]]] = field(default_factory=dict)
    """The arguments of all calls of a function or module."""
    zeros: dict[tuple[int, int, int], Span] = field(default_factory=dict)
    """Where an angle was a 0 without a unit that frames may change."""
    watch: Watch | None = None

    def restart(self, frame: int) -> None:
        """Forget what the last run left, to run what is prepared for another frame."""
        self.frame = frame
        self.spans = SpanMap()
        self.steps = self.objects = self.parts = self.depth = self.node_depth = 0
        self.calls = None
        self.settings = Settings(given=self.settings.given)
        for root in self.roots:
            root[:] = [UNBOUND] * len(root)

    def call_labels(self) -> list[Label]:
        """Labels for the innermost calls that are running."""
        labels: list[Label] = []
        calls = self.calls
        while calls is not None and len(labels) < 2:
            labels.append(Label(calls.span, "in this call"))
            calls = calls.outer
        return labels

    def follows(self, code: str, span: Span) -> bool:
        """Whether a diagnostic may follow from a syntax mistake, there or in a call that is running."""
        if not self.damaged:
            return False
        damage = self.damaged.get(id(span.source), NONE)
        calls = self.calls
        while calls is not None:
            if self.damaged.get(id(calls.span.source), NONE).holds(calls.span):
                return True
            calls = calls.outer
        return damage.explains(code, span)

    def error(
        self,
        code: str,
        message: str,
        span: Span,
        *,
        help: str | None = None,
        fix: Fix | None = None,
        labels: tuple[Label, ...] = (),
    ) -> None:
        """Report a mistake with the calls that led to it, unless it may follow from one of syntax.

        One that shows in the library that ships is reported where that is called.
        """
        site = self.calls.outside() if self.calls is not None and library.holds(span.source) else None
        if site is not None:
            labels, fix, span = (Label(span, "which is used here"),), None, site
        place = (id(span.source), span.start, span.end)
        if self.reported.setdefault(place, code) != code or self.follows(code, span):
            return  # one place, one mistake: what else is wrong there most likely comes of it
        around = self.call_labels() if site is None else []
        if not self.diagnostics.add(code, message, span, labels=(*labels, *around), help=help, fix=fix):
            raise Halt

    def model_label(self) -> tuple[Label, ...]:
        """Where the scene names its model, if it does."""
        given = self.settings.given.get("model")
        return () if given is None else (Label(given, "the model of this scene"),)

    def problem(self, problem: Problem, span: Span, operands: tuple[nodes.Expr | None, ...] = ()) -> None:
        """Report a `Problem` at the operand it blames, or else at ``span``."""
        operand = None
        if problem.operand is not None and problem.operand < len(operands):
            operand = operands[problem.operand]
        place = operand.span if operand else span
        if (id(place.source), place.start, place.end) in self.reported:
            return
        if library.holds(place.source):
            self.error(problem.code, problem.message, place, help=problem.help)
            return
        from scenelang.evaluate.report.type_errors import joined, remember  # only mistakes need it

        alone = operand is not None and problem.code == "E0301"
        blamed = tuple([one for one in ((operand,) if alone else operands) if one is not None])
        if not self.follows(problem.code, place) and joined(
            self, problem.code, problem.message, blamed, place
        ):
            return
        help, fix = problem.help, None
        if problem.fix:
            from scenelang.evaluate.report.habits import advice

            help, fix = advice(problem, operand, self.defined)
        labels = [
            Label(other.span, words)
            for index, words in problem.notes.items()
            if index < len(operands) and (other := operands[index]) is not None
        ]
        if isinstance(operand, nodes.NameRef):
            defined = self.defined.get((id(operand.span.source), operand.span.start))
            if defined is not None:
                labels.append(Label(defined, f"'{operand.name.text}' is defined here"))
        before = len(self.diagnostics)
        self.error(problem.code, problem.message, place, help=help, fix=fix, labels=tuple(labels))
        if len(self.diagnostics) > before:
            remember(self, problem.code, problem.message, blamed)

    def halt(self, code: str, message: str, span: Span, help: str | None = None) -> Halt:
        """Report a limit that was met; the caller raises what this returns."""
        self.error(code, message, span, help=help)
        return Halt()

    def tick(self, steps: int, span: Span) -> None:
        """Count evaluation steps."""
        self.steps += steps
        if self.steps > MAX_STEPS:
            raise self.halt("E0322", f"more than {MAX_STEPS:,} evaluation steps", span)

    def count_parts(self, parts: int, span: Span) -> None:
        """Count nodes, transforms and operations that a Scene will hold."""
        self.parts += parts
        if self.parts > MAX_PARTS:
            raise self.halt("E0320", f"more than {MAX_PARTS:,} nodes and transforms in one scene", span)

    def count_object(self, span: Span) -> None:
        """Count one object."""
        self.count_objects(1, span)

    def count_objects(self, number: int, span: Span) -> None:
        """Count objects that a Scene will hold."""
        self.objects += number
        if self.objects > MAX_OBJECTS:
            raise self.halt("E0320", f"more than {MAX_OBJECTS:,} objects in one scene", span)
