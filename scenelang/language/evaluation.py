"""From the syntax tree to a concrete Scene, and params as values to choose among.

A file is prepared (names resolved, expressions made into closures), then run; both steps report and go on.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from scenelang.assets.records import Record, deep_stack
from scenelang.language import tree as nodes
from scenelang.language.blocks import PreparedBlock
from scenelang.language.builder import Builder, FileContext, Site, make
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile, Span, listing, nearest
from scenelang.language.expressions import prepare
from scenelang.language.library import SpanMap, Written
from scenelang.language.limits import MAX_OBJECTS, MAX_STEPS, Halt
from scenelang.language.parser import parse
from scenelang.language.reporter import Reporter
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene
from scenelang.language.scene_text import hex_colour, number
from scenelang.language.session import UNBOUND, Defines, Loader, Session, Unreadable, Watch, read_source
from scenelang.language.statements import EXPRESSIONS, STATEMENTS, prepare_file
from scenelang.language.values import Angle, RangeValue, Time, Vec, unpack
from scenelang.language.words import STAGE


class Source(Record):
    """A scene as text and what holds for it from outside; path, text or tree is enough.

    ``params`` are text as after ``-D NAME=`` or Python values; `Defines` may be shared by evaluations, whose
    caller reports unused ones. The model and size (pixels) stand instead of the file's, and so does ``fps``,
    which keeps the seconds. Imports cannot leave ``root``, by default the path's folder; ``texts`` has what
    imported files hold, by resolved path, instead of the disk.
    """

    path: str | os.PathLike[str] | None = None
    text: SourceFile | None = None
    tree: nodes.File | None = None
    params: Mapping[str, Any] | Defines | None = None
    model: str | None = None
    root: str | os.PathLike[str] | None = None
    size: tuple[int, int] | None = None
    fps: float | None = None
    texts: Mapping[Path, str] | None = None

    @property
    def values(self) -> dict[str, Any]:
        return dict((self.params.values if isinstance(self.params, Defines) else self.params) or {})

    def parsed(self, diagnostics: Diagnostics) -> Source:
        """The same with text and tree; reports syntax errors once. Raises OSError, SceneError if not text."""
        if self.tree is not None:
            return self
        if (text := self.text) is None:
            name = os.fspath(self.path or "")
            try:
                text = read_source(Path(name), name)
            except Unreadable as error:
                report_unreadable(name, error, diagnostics)
                raise SceneError(diagnostics) from None
        return replace(self, text=text, tree=parse(text, diagnostics))

    def evaluation(
        self, diagnostics: Diagnostics, *, frame: int = 0, replays: bool = False, watch: Watch | None = None
    ) -> Evaluation:
        """Prepare the scene; arguments as for `Evaluation`, and raises as `parsed`."""
        return Evaluation(self.parsed(diagnostics), diagnostics, frame, replays, watch)

    def scene(self, diagnostics: Diagnostics, frame: int = 0) -> tuple[Scene | None, SpanMap]:
        """Evaluate one frame: the Scene, None if anything is wrong with it, and where its nodes were written.

        Mistakes are reported in the order of the text; raises OSError for the file, ValueError for ``size``.
        """
        before, start = len(diagnostics.errors), len(diagnostics)
        try:
            scene, spans = self.evaluation(diagnostics, frame=frame).run(frame)
        except SceneError:
            return None, SpanMap()
        diagnostics.items[start:] = in_file_order(diagnostics.items[start:])
        return (scene if len(diagnostics.errors) == before else None), spans


def report_unreadable(name: str, error: Unreadable, diagnostics: Diagnostics) -> None:
    diagnostics.add(error.code, f"cannot read `{name}`: {error}", Span(SourceFile(name, ""), 0, 0))


class Evaluation:
    """A file prepared once, to be run for any number of frames; the first with a mistake reports it.

    The parsed source is run from ``frame`` on; for ``replays`` and ``watch`` see `Session`. All files that it
    imports are ``wanted``, also absent ones, and ``sources`` are texts. ``context`` has its names.
    """

    def __init__(
        self, source: Source, diagnostics: Diagnostics, frame: int, replays: bool, watch: Watch | None
    ) -> None:
        assert source.tree is not None
        self.file = file = source.tree
        self.diagnostics, self._size, self._model = diagnostics, source.size, source.model
        self.animates = any(isinstance(s, nodes.Call) and s.name.text == "animate" for s in file.statements)
        self._errors = len(diagnostics.errors)
        self._steps = self._objects = 0
        session = Session(Reporter(diagnostics), EXPRESSIONS, STATEMENTS, frame, source.fps, watch=watch)
        session.replays = replays and self.animates
        self._session = session
        path = None if source.path is None else Path(source.path).resolve()
        folder = (path and path.parent) if source.root is None else Path(source.root).resolve()
        loader = Loader(folder, [path] if path is not None else [], texts=source.texts or {})
        params = source.params
        self.inputs = given = params if isinstance(params, Defines) else Defines(params or {})
        self.context = FileContext(file.span.source, session, loader, given, path)
        self._body: PreparedBlock | None = None
        if not self.animates:
            session.animated[:] = [0.0, 0.0, 0.0, 1.0]
        with deep_stack(), suppress(Halt):
            self._body = prepare_file(self.context, file)
            given.lost |= session.report.damage(file.span.source).words
            if given is not params:
                given.report_unused(diagnostics)
        self.wanted = tuple(loader.wanted)
        self.sources = (file.span.source, *(imported.span.source for imported in loader.parsed.values()))

    @property
    def frames(self) -> int:
        """Number of frames of the animation, as far as the last run knows; 1 without one."""
        animation = self._session.settings.animation
        return 1 if animation is None else animation.frames

    @property
    def spent(self) -> bool:
        """Test whether all runs together exceed the limits of one."""
        return self._steps > MAX_STEPS or self._objects > MAX_OBJECTS

    def warn_of_zeros(self) -> None:
        """Warn of angles that were 0 without a unit whenever they were met, and that frames may change."""
        errors = self.diagnostics.errors
        wrong = {d.span for d in errors} | {label.span for d in errors for label in d.labels}
        for span in self._session.zeros.values():
            if span not in wrong:
                message = "0 without a unit, which another frame may change"
                help = "any other number is an error: multiply by 1deg, 1rad or 1turn"
                self.diagnostics.add("W0303", message, span, help=help)

    def run(self, frame: int) -> tuple[Scene | None, SpanMap]:
        """Evaluate a frame; the Scene is None if anything was wrong so far, in any frame."""
        session, before = self._session, len(self.diagnostics)
        if not self.animates and frame != 0:
            self.diagnostics.add("E0337", f"frame {frame} of a scene without animate(…)", None)
        session.restart(frame)
        if self.animates:
            session.animated[:] = [UNBOUND] * 4
        out = Builder()
        if self._body is not None:
            with deep_stack(), suppress(Halt):
                session.tick(self._body.weight, self.file.span)
                for act in self._body.actions:
                    act(self.context.env, out)
        self._steps += session.steps
        self._objects += session.objects
        if self.animates and frame:
            name_frame(self.diagnostics, before, frame)
        if self._body is None or len(self.diagnostics.errors) > self._errors:
            return None, session.spans
        settings = session.settings
        fields: dict[str, Any] = {"version": 1, "model": self._model or settings.model}
        fields |= {name: getattr(settings, name) for name in ("canvas", "background", "samples")}
        fields |= {word: settings.stage.get(word, "default") for word in STAGE}
        fields |= {"animation": settings.animation, "elements": tuple(session.elements.values())}
        scene = make(Scene, {**fields, "nodes": tuple(out.children)})
        scene = scene if self._size is None else scene.sized(self._size)
        session.spans.main = self.file.span.source
        for written in settings.given.get("model", ())[:1]:
            session.spans.record(scene, Written(written, written))
        return scene, session.spans


def name_frame(diagnostics: Diagnostics, since: int, frame: int) -> None:
    """Add the number of a frame to the messages of all diagnostics from index ``since`` on."""
    for index, d in enumerate(diagnostics.items[since:], since):
        if d.code != "E0337":  # which names it
            diagnostics.items[index] = replace(d, message=f"{d.message} (frame {frame})")


def in_file_order(found: list[Diagnostic]) -> list[Diagnostic]:
    """Diagnostics by place, file by file as they were first met; those without a place come last."""
    files: dict[str, int] = {}

    def key(d: Diagnostic) -> tuple[int, int]:
        if d.span is None:
            return len(found), 0
        return files.setdefault(d.span.source.name, len(files)), d.span.start

    return sorted(found, key=key)


def load(
    path: str | os.PathLike[str],
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
    size: tuple[int, int] | None = None,
    diagnostics: Diagnostics | None = None,
    **values: Any,
) -> Scene:
    """Read a scene file: ``load("chain.nsg", k=0.9)``.

    Args:
        path: the file.
        params: values for params whose names are not Python identifiers (``lib.k``) or clash with an
            argument here.
        model: render with this model instead of the one that the file names.
        root: folder that imports cannot leave; by default the file's.
        frame: frame of the animation, from 0.
        size: canvas in pixels instead of the scene's.
        diagnostics: collects what is found, warnings too.
        **values: values for params: numbers, booleans, sequences, or text as after ``-D NAME=``, which
            is how angles (``"30deg"``) and colours (``"#d33"``) are written.

    Returns:
        The Scene.

    Raises:
        SceneError: the scene has errors; it carries all diagnostics.
        ValueError: ``size`` is not a canvas.
        OSError: the file cannot be opened.
    """
    source = Source(path, params={**(params or {}), **values}, model=model, root=root, size=size)
    return _sound(source, diagnostics, frame)[0]


def loads(
    text: str,
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
    size: tuple[int, int] | None = None,
    diagnostics: Diagnostics | None = None,
    name: str = "<text>",
    **values: Any,
) -> Scene:
    """Read scene text, called ``name`` in messages; as `load`, but imports are refused without ``root``."""
    given = {**(params or {}), **values}
    source = Source(text=SourceFile(name, text), params=given, model=model, root=root, size=size)
    return _sound(source, diagnostics, frame)[0]


def opened(
    given: Scene | str | os.PathLike[str], diagnostics: Diagnostics, size: tuple[int, int] | None = None
) -> tuple[Scene, SpanMap | None]:
    """A Scene as it is, or a file's, and where its nodes were written; raises TypeError, and as `load`."""
    if isinstance(given, Scene):
        return given if size is None else given.sized(size), None
    if not isinstance(given, str | os.PathLike):
        raise TypeError(f"{type(given).__name__} where a Scene or the path of one is needed")
    return _sound(Source(given, size=size), diagnostics)


def _sound(source: Source, diagnostics: Diagnostics | None, frame: int = 0) -> tuple[Scene, SpanMap]:
    result = Diagnostics() if diagnostics is None else diagnostics
    scene, spans = source.scene(result, frame)
    if scene is None:
        raise SceneError(result)
    return scene, spans


MOST_CHOICES: Final = 1000
_UNITS: Final = {"deg": 180 / math.pi, "rad": 1.0, "turn": 0.5 / math.pi, "s": 1.0, "ms": 1000.0}
_DIGITS: Final = 4


class ParamError(ValueError):
    """No such param, or one without values to choose among."""


class Axis(Record):
    """One number, or one choice, that is searched."""

    label: str  # what reports call it: ``k``, or ``ink.2`` of a vector
    low: float = 0.0  # in base units
    high: float = 1.0
    choices: tuple[Any, ...] = ()  # none where it is continuous
    wraps: bool = False  # whether both ends mean the same, as those of a full turn do


class Knob(Record):
    """A param that is searched."""

    stmt: nodes.Param
    value: Any  # its default
    axes: tuple[Axis, ...]  # one, or one for each number of a vector
    inner: bool  # whether the value is a vector of the axes' numbers

    @property
    def name(self) -> str:
        return self.stmt.name.text


def params_of(evaluation: Evaluation) -> dict[str, nodes.Param]:
    """The params of the file itself, by name; those of imports are other files'."""
    return {stmt.name.text: stmt for stmt in evaluation.file.statements if isinstance(stmt, nodes.Param)}


def param_named(evaluation: Evaluation, name: str) -> nodes.Param:
    """A param of the file itself; raises `ParamError` without one."""
    known = params_of(evaluation)
    if name in known:
        return known[name]
    near = nearest(name, known)
    help = f"did you mean `{near}`?" if near else f"its params are {listing(known)}" if known else ""
    raise ParamError(f"no param `{name}` in `{evaluation.file.span.source.name}`" + f"; {help}" * bool(help))


def knob_of(stmt: nodes.Param, file: FileContext) -> Knob:
    """Values that a param may be set to, after a run; raises `ParamError` where nothing gives them."""
    name, value = stmt.name.text, file.value(stmt.name.text)
    allowed: Any = None
    if stmt.range is not None:
        allowed = prepare(stmt.range, Site(file, file.scope, "file")).run(file.env)
    if allowed.__class__ is Vec:
        return Knob(stmt, value, (Axis(name, choices=_few(name, allowed.items)),), False)
    if value.__class__ is bool:
        return Knob(stmt, value, (Axis(name, choices=(False, True)),), False)
    if value.__class__ is Vec:
        if allowed is None and is_colour(stmt.default):
            allowed = RangeValue(0.0, 1.0, False, None, "number")
        if isinstance(allowed, RangeValue):
            axes = tuple(_axis(f"{name}.{at}", allowed) for at in range(1, len(value.items) + 1))
            return Knob(stmt, value, axes, True)
    if not isinstance(allowed, RangeValue):
        raise ParamError(f"param `{name}` has no range; give it one, as in `param {name} = … in 0..1;`")
    return Knob(stmt, value, (_axis(name, allowed),), False)


def check_width(name: str, low: float, high: float) -> None:
    """Raise `ParamError` for a range without values between its ends that can be computed and written."""
    if not math.isfinite((high - low) * max(_UNITS.values())):
        raise ParamError(f"the range of param `{name}` is too wide: from {low:.6g} to {high:.6g}")


def _axis(label: str, allowed: RangeValue) -> Axis:
    check_width(label, allowed.start, allowed.stop)
    if allowed.step is not None:
        if math.isinf((allowed.stop - allowed.start) / allowed.step) or allowed.count() > MOST_CHOICES:
            raise ParamError(f"param `{label}` has more than {MOST_CHOICES:,} steps")
        return Axis(label, choices=_few(label, tuple(allowed)))
    low, high = allowed.start, allowed.stop
    if allowed.exclusive:
        high -= 1e-9 * (high - low)
    turn = allowed.unit == "angle" and math.isclose(high - low, 2 * math.pi, rel_tol=1e-6)
    return Axis(label, low, high, wraps=turn)


def _few(name: str, choices: tuple[Any, ...]) -> tuple[Any, ...]:
    if not 0 < len(choices) <= MOST_CHOICES:
        found = f"{len(choices):,} choices, where 1 to {MOST_CHOICES:,} can be tried"
        raise ParamError(f"param `{name}` has {found}")
    return choices


def is_colour(expr: nodes.Expr) -> bool:
    """Test whether an expression is written as a colour."""
    called = expr.name.text if isinstance(expr, nodes.CallExpr) else ""
    return isinstance(expr, nodes.ColorLiteral) or called in ("rgb", "hsv")


def value_at(axis: Axis, u: float, like: Any) -> Any:
    """The value at a place of an axis, of the kind that the default's numbers are of."""
    if axis.choices:
        return axis.choices[round(u)]
    if like.__class__ is Vec:
        like = like.items[0]
    x = axis.low + u * (axis.high - axis.low)
    return like.__class__(x) if like.__class__ in (Angle, Time) else x


def written(knob: Knob, value: Any, digits: int = _DIGITS) -> str:
    """A value as its statement would have it, in the default's unit; ``digits`` are of the range's width."""
    if not knob.inner:
        return _literal(value, knob.axes[0], knob.stmt.default, digits)
    if is_colour(knob.stmt.default):
        r, g, b = (min(255, max(0, round(255 * item))) / 255 for item in value.items)
        return hex_colour((r, g, b)) or ""
    items = zip(value.items, knob.axes, strict=True)
    return f"[{', '.join(_literal(item, axis, knob.stmt.default, digits) for item, axis in items)}]"


def _literal(value: Any, axis: Axis, default: nodes.Expr, digits: int) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if value.__class__ is Vec:
        colour = tuple(item for item in value.items if isinstance(item, float))
        if len(colour) == len(value.items) == 3 and (text := hex_colour(colour)):
            return text
        return f"[{', '.join(_literal(item, axis, default, digits) for item in value.items)}]"
    x, kind = unpack(value)
    unit = ""
    if kind != "number":
        units = (node.unit for node in nodes.walk(default) if isinstance(node, nodes.NumberLiteral))
        unit = next(filter(None, units), "deg" if kind == "angle" else "s")
    factor = _UNITS.get(unit, 1.0)
    if axis.choices:
        return number(round(x * factor, 9)) + unit
    width = (axis.high - axis.low) * factor
    places = max(0, digits - math.floor(math.log10(width))) if width > 0 else 9
    low, high, tick = axis.low * factor, axis.high * factor, 10.0**-places
    near = round(x * factor, places)  # rounding may not leave the range
    near = near - tick if near > high else near + tick if near < low else near
    return number(round(near, places) + 0.0) + unit


def literals_of(evaluation: Evaluation, names: Iterable[str]) -> dict[str, str]:
    """The values that params of the file had in the last run, as text of the language."""
    literals, file = {}, evaluation.context
    for name, stmt in params_of(evaluation).items():
        if name in names:
            value = file.value(name)
            literals[name] = written(Knob(stmt, value, (Axis(name, choices=(value,)),), False), value)
    return literals


def rewritten(file: nodes.File, literals: Mapping[str, str]) -> str:
    """A scene's text with other defaults of its params, by name; all else stays as it was."""
    text = file.span.source.text
    for stmt in reversed(file.statements):
        if isinstance(stmt, nodes.Param) and stmt.name.text in literals:
            span = stmt.default.span
            text = text[: span.start] + literals[stmt.name.text] + text[span.end :]
    return text
