"""Scenes as forms: their own program as JSON, for the evaluator that runs in a page.

A form is the trees of a scene's files, without mistakes, names resolved. An expression is a number, a
boolean, or a list of a word and its operands; a statement is a list likewise, a block a list of statements.
``["g", slot]`` is a variable of a file, ``["v", hops, slot]`` one of the call so many definitions further
out, and ``["no", why]`` a word that the page's model does not have: an error only where it runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import field
from functools import cache
from typing import Any, Final, TypeVar
from unicodedata import normalize

from scenelang.assets.element import BY_POINTS, Element, Gradient
from scenelang.assets.element_file import load_textures, name_of
from scenelang.assets.records import Record, deep_stack
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.spaces import FADE, Sky, Stage, stage_data
from scenelang.language import scene, words
from scenelang.language import tree as nodes
from scenelang.language.builder import FileContext, Site
from scenelang.language.evaluation import Evaluation, is_colour
from scenelang.language.expressions import prepare
from scenelang.language.nodes import MOST
from scenelang.language.scene import Brought, Color, Matrix, Object, Scale, Translate, objects_of
from scenelang.language.scopes import find, head_of
from scenelang.language.statements import BROUGHT
from scenelang.language.values import COMPONENTS, CONSTANTS, Angle, RangeValue, Time, Vec, unpack

Json = Any
Worn = Element | Gradient
T = TypeVar("T", Element, Worn)


class Frame(Record, frozen=False):
    """The slots of a call of a function or a module; slot 0 holds the call around it."""

    outer: Frame | None
    size: int = 1


class PageScope(Record, frozen=False):
    """The names of a block, and the block around it; without a frame its slots are those of files."""

    frame: Frame | None = None
    parent: PageScope | None = None
    names: dict[str, Bound] = field(default_factory=dict)

    def find(self, name: str) -> Bound | None:
        """The binding of a name, qualified or not."""
        alias, dot, rest = name.partition(".")
        result = find(self, alias)
        return result.inside.names.get(rest) if dot and result is not None and result.inside else result


class Bound(Record, frozen=False):
    """The binding of a name."""

    kind: str  # as of `scenelang.language.session.Binding`
    scope: PageScope  # of its definition
    slot: int = 0
    node: Any = None  # the statement of a fn or module
    inside: PageScope | None = None  # the names of an imported file
    file: FileContext | None = None
    at: int = -1  # index of a fn or module in `Writer.calls`, -1 for one that is not called
    uses: list[Bound] = field(default_factory=list)  # names of files
    element: str = ""  # the name in a Scene of a geometry from a file of elements
    constant: Json = None  # the value of a size or a centre from one


Line = tuple[Json, Bound | None, list[Bound]]
"""A statement of a file, the name that it defines, and the names of files that it uses."""


def bind(params: Sequence[str], args: Sequence[nodes.Argument] | None) -> list[nodes.Expr | None]:
    """The argument of each parameter, None where it is left out."""
    bound: dict[str, nodes.Expr] = {}
    for at, arg in enumerate(args or ()):
        bound[params[at] if arg.name is None else arg.name.text] = arg.value
    return [bound.get(name) for name in params]


class Lacking(Exception):
    """Raised where the page's model lacks a material or an element; the message names it."""


class Writer:
    """Writes statements of a scene's files as forms; ``elements`` come first in `shapes` and `paints`."""

    def __init__(
        self, context: FileContext, manifest: Manifest, elements: Iterable[Worn], draft: bool = False
    ) -> None:
        self.slots = 0  # of all files
        self.calls: list[Json] = []  # forms of the fns and modules that are called
        self.uses: list[Bound] = []
        # full name, statement, file and binding
        self.params: list[tuple[str, nodes.Param, FileContext, Bound]] = []
        # names of files that these settings use
        self.lengths: dict[str, list[Bound]] = {"canvas": [], "animate": []}
        self.manifest, listed, self.draft = manifest, list(elements), draft
        self.files = {file.name: file.zoo for file in context.session.elements.values()}
        self.brought = Brought.of(tuple(context.session.elements.values()))
        self.textures = load_textures()
        self.shapes = [e for e in listed if isinstance(e, Element) and not e.material]
        self.paints: list[Worn] = [element for element in listed if element.material]
        self.fonts: list[str] = []  # files whose letters are set
        self.written = {chr(int(e.name[1:], 16)) for e in self.shapes if e.form == "outline"}
        """Characters of all strings."""

    def block(self, block: nodes.Block, around: PageScope, kind: str) -> Json:
        """A block in a scope of its own."""
        scope = PageScope(around.frame, around)
        bodies = self._declare(block.statements, scope)
        forms = [self.statement(stmt, scope, kind) for stmt in block.statements]
        for bound in bodies:
            self._body(bound)
            self.uses += bound.uses
        return [form for form in forms if form is not None]

    def file(self, context: FileContext, tree: nodes.File, scope: PageScope, imported: bool) -> list[Line]:
        """The statements of a file; of an imported one the exported definitions."""
        statements = [s for s in tree.statements if not imported or isinstance(s, BROUGHT)]
        self._declare(statements, scope)
        lines: list[Line] = []
        for stmt in statements:
            self.uses = []
            if isinstance(stmt, nodes.Import):
                brought, inside = context.scope.names[stmt.alias.text].value, PageScope()
                scope.names[stmt.alias.text] = Bound("import", scope, inside=inside, file=brought)
                if (imported_tree := context.loader.parsed.get(brought.path)) is not None:
                    lines += self.file(brought, imported_tree, inside, imported=True)
                    continue
                known = context.session.elements[brought.path].name
                for name, binding in brought.scope.names.items():
                    inside.names[name] = bound = Bound(binding.kind, inside, file=brought)
                    if binding.kind == "let":
                        bound.constant = _form(binding.value)
                    else:
                        bound.element = binding.value if binding.kind == "element" else known
            elif isinstance(stmt, nodes.Let | nodes.Param):
                form = self.statement(stmt, scope, "file")
                bound = scope.names[stmt.name.text]
                bound.uses = self.uses
                lines.append((form, bound, self.uses))
                if isinstance(stmt, nodes.Param):
                    full = context.prefix + stmt.name.text
                    form[2] = full
                    self.params.append((full, stmt, context, bound))
            elif form := self.statement(stmt, scope, "file"):
                lines.append((form, None, self.uses))
            if isinstance(stmt, nodes.Call) and stmt.name.text in self.lengths:
                self.lengths[stmt.name.text] += self.uses
        return lines

    def reached(self, roots: Iterable[Bound]) -> set[int]:
        """Identities of all names of files that ``roots`` need; writes the fns and modules among them."""
        seen: dict[int, Bound] = {}
        stack = list(roots)
        while stack:
            bound = stack.pop()
            if id(bound) not in seen:
                seen[id(bound)] = bound
                if bound.at >= 0 and self.calls[bound.at] is None:
                    self._body(bound)
                stack += bound.uses
        return set(seen)

    def _declare(self, statements: Sequence[nodes.Stmt], scope: PageScope) -> list[Bound]:
        result = []
        for stmt in statements:
            if isinstance(stmt, nodes.Fn | nodes.Module):
                kind = "fn" if isinstance(stmt, nodes.Fn) else "module"
                scope.names[stmt.name.text] = bound = Bound(kind, scope, node=stmt)
                result.append(bound)
        return result

    def _body(self, bound: Bound) -> None:
        """Write a fn or module: number of slots of a call, defaults, body."""
        at, stmt = self._called(bound), bound.node
        around, self.uses = self.uses, bound.uses
        frame = Frame(bound.scope.frame, 1 + len(stmt.params))
        inside, defaults = PageScope(frame, bound.scope), []
        for slot, param in enumerate(stmt.params, 1):
            defaults.append(None if param.default is None else self.expression(param.default, inside))
            inside.names[param.name.text] = Bound("argument", inside, slot)
        self.calls[at] = form = [0, defaults]
        if isinstance(stmt, nodes.Fn):
            form.append(self.expression(stmt.body, inside))
        else:
            form.append(self.block(stmt.body, inside, "group"))
        form[0] = frame.size
        self.uses = around

    def _called(self, bound: Bound) -> int:
        if bound.at < 0:
            bound.at = len(self.calls)
            self.calls.append(None)
        return bound.at

    def hops(self, scope: PageScope, to: PageScope) -> int:
        """Number of calls between a scope and the slots of another; -1 for those of files."""
        hops, frame = 0, scope.frame
        while frame is not to.frame:
            assert frame is not None
            hops, frame = hops + 1, frame.outer
        return -1 if frame is None else hops

    def value(self, bound: Bound, scope: PageScope) -> Json:
        """A variable."""
        if bound.constant is not None:
            return bound.constant
        if bound.scope.frame is None:
            self.uses.append(bound)
            return ["g", bound.slot]
        return ["v", self.hops(scope, bound.scope), bound.slot]

    def call(self, bound: Bound, args: Sequence[nodes.Argument], scope: PageScope) -> list[Json]:
        """Place of a definition, hops to where it stands, and the arguments."""
        if bound.scope.frame is None:
            self.uses.append(bound)
        given = bind([param.name.text for param in bound.node.params], args)
        return [self._called(bound), self.hops(scope, bound.scope), self.given(given, scope)]

    def given(self, values: Iterable[nodes.Expr | None], scope: PageScope) -> list[Json]:
        """Arguments, None where one is left out."""
        return [None if value is None else self.expression(value, scope) for value in values]

    def expression(self, expr: nodes.Expr, scope: PageScope) -> Json:
        """An expression: a number, a boolean, or a word and its operands."""
        match expr:
            case nodes.NumberLiteral():
                return [expr.unit, plain(expr.value)] if expr.unit else plain(expr.value)
            case nodes.Bool():
                return expr.value
            case nodes.String():
                self.written |= {*expr.value, *normalize("NFC", expr.value)}
                return ["'", expr.value]
            case nodes.ColorLiteral():
                return ["#", *(round(255 * part) for part in expr.rgb)]
            case nodes.Vector():
                return ["[", *self.given(expr.items, scope)]
            case nodes.ForItem():
                items, inside = self.expression(expr.iterable, scope), PageScope(scope.frame, scope)
                target = self._define(expr.variable, "loop", inside)
                return ["for", *target, items, self.expression(expr.body, inside)]
            case nodes.IfItem():
                return ["if", self.expression(expr.condition, scope), self.expression(expr.body, scope)]
            case nodes.Range():
                ends = self.given((expr.start, expr.stop, expr.step), scope)
                return ["..", int(expr.exclusive), *ends[: 2 if expr.step is None else 3]]
            case nodes.NameRef():
                if (bound := scope.find(expr.name.text)) is not None:
                    return self.value(bound, scope)
                if expr.name.text in words.ANIMATED:
                    return ["t", [*words.ANIMATED].index(expr.name.text)]
                constant = CONSTANTS[expr.name.text]
                if isinstance(constant, Vec):
                    return _form(constant)
                return ["none"] if constant is None else constant
            case nodes.Unary():
                inner = self.expression(expr.operand, scope)
                negative = expr.op == "-" and type(inner) in (int, float) and inner
                return -inner if negative else [f"{expr.op}1", inner]
            case nodes.Binary():
                return [expr.op, self.expression(expr.left, scope), self.expression(expr.right, scope)]
            case nodes.Conditional():
                return ["?", *self.given((expr.condition, expr.then, expr.otherwise), scope)]
            case nodes.CallExpr():
                name, bound = expr.name.text, scope.find(expr.name.text)
                if bound is not None and bound.kind == "width":
                    return ["width", self._font(bound), *self._text("width", expr.args, scope)]
                if bound is not None:
                    return ["call", *self.call(bound, expr.args, scope)]
                if name == "str":
                    self.written |= {*"0123456789-.e", *"true", *"false"}
                word = words.FUNCTIONS[name]
                args = [arg.value for arg in expr.args] if word.variadic else bind(word.params, expr.args)
                return [name, *self.given((arg for arg in args if arg is not None), scope)]
            case nodes.Index():
                return ["@", self.expression(expr.value, scope), self.expression(expr.index, scope)]
            case nodes.Member():
                alias = scope.find(expr.value.name.text) if isinstance(expr.value, nodes.NameRef) else None
                if alias is not None and alias.inside is not None:
                    return self.value(alias.inside.names[expr.name.text], scope)
                return [".", self.expression(expr.value, scope), COMPONENTS[expr.name.text]]
            case nodes.MaterialExpr():
                return self._material(expr, scope)
        raise TypeError(f"no form of {expr.__class__.__name__}")

    def _material(self, written: nodes.MaterialExpr | nodes.MaterialUse, scope: PageScope) -> Json:
        """``["material", index of its shading, index of its paint or -1, block]``."""
        name, shading = written.name.text, written.shading
        alias, dot, rest = name.partition(".")
        element: Worn | None = self.textures.get(name)
        if name in words.GRADIENTS:
            element = Gradient(name)  # whose stops are among the operations
        if dot and (file := scope.find(alias)) is not None and file.file is not None:
            element = self.brought.materials[file.file.materials[rest]]
        try:
            look = self._look(name, element, None if shading is None else shading.text)
        except Lacking as lacking:
            return ["no", str(lacking)]
        ops = [] if written.body is None else self.block(written.body, scope, "material")
        return ["material", *look, ops]

    def _look(self, name: str, element: Worn | None, shading: str | None = None) -> tuple[int, int]:
        """Indices of a material's shading and of its paint, -1 for none."""
        lit = name if element is None else shading or self.manifest.materials[0]
        paint = -1 if element is None else self._element(element, self.paints, name)
        if lit in words.REFLECTING and self.draft:
            lit = self.manifest.materials[0]
        if lit in words.REFLECTING:
            raise Lacking(f"pages do not draw `{lit}`")
        if lit not in self.manifest.materials:
            raise Lacking(f"model `{self.manifest.name}` has no material `{lit}`")
        return self.manifest.materials.index(lit), paint

    def _element(self, element: T, known: list[T], name: str) -> int:
        if element not in known:
            if element.kind not in self.manifest.elements:
                raise Lacking(f"model `{self.manifest.name}` does not draw `{name}`")
            known.append(element)
        return known.index(element)

    def statement(self, stmt: nodes.Stmt, scope: PageScope, kind: str) -> Json:
        """A statement in a kind of block; None where it does nothing when it runs."""
        match stmt:
            case nodes.Let():
                value = self.expression(stmt.value, scope)
                return [*self._define(stmt.name, "let", scope), value]
            case nodes.Param():
                given = self.given((stmt.default, stmt.range), scope)
                return ["param", self._define(stmt.name, "param", scope)[1], stmt.name.text, *given]
            case nodes.For():
                items, inside = self.expression(stmt.iterable, scope), PageScope(scope.frame, scope)
                target = self._define(stmt.variable, "loop", inside)
                return ["for", *target, items, self.block(stmt.body, inside, kind)]
            case nodes.If():
                test, then = self.expression(stmt.condition, scope), self.block(stmt.then, scope, kind)
                other = stmt.otherwise
                if isinstance(other, nodes.If):
                    return ["if", test, then, [self.statement(other, scope, kind)]]
                return ["if", test, then, [] if other is None else self.block(other, scope, kind)]
            case nodes.Node():
                inner = "chain" if stmt.kind == "chain" else "group"
                return ["node", stmt.kind, self._width(stmt, scope), self.block(stmt.body, scope, inner)]
            case nodes.Combined():
                width, child = self._width(stmt, scope), self.statement(stmt.child, scope, kind)
                return ["join", stmt.op, width, child]
            case nodes.MaterialUse():
                return ["use", self._material(stmt, scope)]
            case nodes.Call():
                return self._headed(stmt, scope, kind)
        return None

    def _define(self, name: nodes.Name, kind: str, scope: PageScope) -> list[Json]:
        """Give a name a new slot: ``["g", slot]`` of files, or ``["v", slot]`` of a call."""
        if scope.frame is None:
            word, slot, self.slots = "g", self.slots, self.slots + 1
        else:
            word, slot, scope.frame.size = "v", scope.frame.size, scope.frame.size + 1
        scope.names[name.text] = Bound(kind, scope, slot)
        return [word, slot]

    def _width(self, stmt: nodes.Node | nodes.Combined, scope: PageScope) -> Json:
        return self.given(bind(("k",), stmt.args), scope)[0]

    def _headed(self, stmt: nodes.Call, scope: PageScope, kind: str) -> Json:
        name = stmt.name.text
        bound = None if name in words.LANGUAGE else scope.find(name)
        head = head_of(stmt, bound, kind)
        if head == "move" and name == "roughness":
            self._move(stmt, scope, True)  # for the names that it uses
            return None if self.draft else ["no", f"pages do not draw `{name}`"]
        if head == "setting":
            args = self.given(bind(words.SETTINGS[name].params, stmt.args), scope)
            if name in words.STAGE and self.manifest.dimension == 2:
                return ["no", f"model `{self.manifest.name}` is flat and has no {name}"]
            word = (name,) if name == "animate" else ("set", name)
            return None if name == "canvas" else [*word, *args]
        if head == "move":
            return self._move(stmt, scope, kind == "material")
        body = None if stmt.body is None else self.block(stmt.body, scope, "object")
        if bound is None and name in words.OUTLINES:
            if self.manifest.dimension == 3:
                return ["no", f"`{name}` is a leaf of the plane"]
            points = self.given(bind(words.OUTLINES[name].params, stmt.args), scope)
            return ["outline", name, *points, body or []]
        if bound is None or head == "leaf":
            if name not in self.manifest.geometries:
                return ["no", f"model `{self.manifest.name}` has no geometry `{name}`"]
            return ["object", self.manifest.geometries.index(name), body or []]
        if bound.kind == "module":
            return ["module", *self.call(bound, stmt.args or (), scope), body or []]
        if bound.kind == "text":
            return ["text", self._font(bound), self._text("text", stmt.args, scope), body or []]
        if bound.element:
            return self._brought(stmt, bound.element, body or [])
        ops = [] if stmt.body is None else self.block(stmt.body, scope, "material")
        return ["use", self.value(bound, scope), *([ops] if ops else [])]

    def _move(self, stmt: nodes.Call, scope: PageScope, inks: bool) -> Json:
        name, args = stmt.name.text, stmt.args or ()
        table = words.OPERATIONS if inks else words.TRANSFORMS
        if name not in table:
            return ["no", f"`{name}` does not stand here"]
        if name in words.SOLID_TRANSFORMS and self.manifest.dimension == 2:
            return ["no", f"`{name}` leaves the plane"]
        if name == "scale" and len(args) == 1 and (args[0].name is None or args[0].name.text == "s"):
            return ["move", "even", self.expression(args[0].value, scope)]
        return ["move", name, *self.given(bind(table[name].params, args), scope)]

    def _brought(self, stmt: nodes.Call, called: str, body: Json) -> Json:
        """A geometry of a file of elements, or a ready group."""
        alias, _, name = called.partition(".")
        try:
            if stmt.args is None:
                return ["object", self._shape(called), body]
            zoo = self.files[alias]
            assert zoo is not None
            return ["parts", [self._part(part) for part in objects_of(zoo, alias, name)], body]
        except Lacking as lacking:
            return ["no", str(lacking)]

    def _font(self, bound: Bound) -> int:
        """The index of a file among the fonts."""
        if bound.element not in self.fonts:
            self.fonts.append(bound.element)
        return self.fonts.index(bound.element)

    def _text(self, word: str, args: Sequence[nodes.Argument] | None, scope: PageScope) -> list[Json]:
        """Arguments of a line of letters."""
        given = bind(words.LETTERS[word].params, args)
        aligned = [one for one in given[2:] if isinstance(one, nodes.String)]  # which is no text
        result = self.given(given[: 3 - len(aligned)], scope)
        return [*result, *(["'", one.value] for one in aligned)]

    def font(self, file: str) -> Json:
        """Letters of a font that strings of the scene have, and their kerning."""
        zoo = self.files[file]
        assert zoo is not None
        assert zoo.font is not None
        font, letters, pairs = zoo.font, dict[str, Json](), dict[str, float]()
        parts = {*normalize("NFD", "".join(self.written))}  # which joined texts may bring together
        made = {one for one in font.letters if len(own := {*normalize("NFD", one)}) > 1 and own <= parts}
        for letter in sorted(self.written & font.letters.keys() | made):
            advance, x, y, radius = font.metrics[font.letters[letter]]
            called = name_of(letter)
            shape = self._shape(f"{file}.{called}") if called in font.glyphs else -1
            letters[letter] = [shape, *map(plain, (advance, x, y, radius))]
        for one in letters:
            pairs |= {one + other: kern for other in letters if (kern := font.kerning(one, other))}
        return {"letters": letters, "pairs": pairs}

    def _shape(self, called: str) -> int:
        element = self.brought.geometries[called]
        return len(self.manifest.geometries) + self._element(element, self.shapes, called)

    def _part(self, part: Object) -> Json:
        """One object of a group, as its statement."""
        lines: list[Json] = []
        for move in part.transforms:
            if isinstance(move, Matrix):
                lines.append(["move", "matrix", ["[", *(["[", *map(plain, row)] for row in move.rows)]])
            elif isinstance(move, Scale):
                lines.append(["move", "even", plain(move.x)])
            elif isinstance(move, Translate):
                lines.append(["move", "translate", *map(plain, (move.x, move.y, move.z))])
        if part.material is not None:
            name = part.material.name
            inks = [op.rgb for op in part.material.ops if isinstance(op, Color)]
            ops = [["move", "color", ["[", *map(plain, rgb)]] for rgb in inks]
            lines.append(["use", ["material", *self._look(name, self.brought.materials.get(name)), ops]])
        return ["object", self._shape(part.geometry), lines]


def _form(value: float | Vec) -> Json:
    return ["[", *map(plain, value.items)] if isinstance(value, Vec) else plain(value)


def plain(number: float) -> float:
    """The same number, short in JSON."""
    return int(number) if float(number).is_integer() and abs(number) < 1e15 else float(number)


_KINDS: Final = {float: "number", Angle: "angle", Time: "time", bool: "bool", str: "string"}
_WHY: Final = {
    "canvas": "the size of the canvas depends on it",
    "animate": "the length of the animation depends on it",
}
_LABEL: Final = re.compile(r"[ \t)]*;[ \t]*//[ \t]*([^\n]*)")


class PageProgram(Record):
    """A scene's form and its params in a view."""

    data: Json  # for `evaluateForm`
    params: list[Json]  # that matter to the picture: their values, in radians and seconds, and ranges
    fixed: list[Json]  # names of those that no page can change, and why
    shapes: tuple[Element, ...]  # that rows name by index, behind the model's geometries
    paints: tuple[Worn, ...]


def form_of(
    evaluation: Evaluation, manifest: Manifest, elements: Iterable[Worn] = (), *, draft: bool = False
) -> PageProgram:
    """The form of a scene that was evaluated without errors; params start from the values of that run.

    The Program's elements come first among shapes and paints, in their order. In a ``draft`` what reflects is
    matte.
    """
    writer, reasons = Writer(evaluation.context, manifest, elements, draft), dict[str, str]()
    with deep_stack():
        lines = writer.file(evaluation.context, evaluation.file, PageScope(), imported=False)
        needed = writer.reached(one for _, bound, uses in lines if bound is None for one in uses)
        for word, uses in writer.lengths.items():
            reached = writer.reached(uses)
            reasons |= {name: _WHY[word] for name, _, _, bound in writer.params if id(bound) in reached}
    fonts: list[Json] = []
    with suppress(Lacking):  # of a solid scene, which was refused
        fonts += [writer.font(file) for file in writer.fonts]
    data = {
        "model": manifest.name,
        "dimension": manifest.dimension,
        "body": [form for form, bound, _ in lines if bound is None or id(bound) in needed],
        "animates": evaluation.animates,
        "slots": writer.slots,
        "calls": writer.calls,
        "plain": 0,
        "stage": _stage(),
        "media": [at for at, name in enumerate(manifest.materials) if name == "volumetric"],
        "geometries": manifest.geometries,
        "spatial": [int(paint.dimension == 3) for paint in writer.paints],
        "graded": [int(isinstance(paint, Gradient)) for paint in writer.paints],
        "blends": manifest.any_blend,
        "fonts": fonts,
        "outlines": [
            [e.form, len(manifest.geometries) + at, [n for point in e.points for n in point]]
            for at, e in enumerate(writer.shapes)
            if e.form in BY_POINTS
        ],
        "turns": [manifest.limits.get("inner_warps", 0), manifest.limits.get("outer_warps", 0)],
    }
    shown = [one for one in writer.params if id(one[3]) in needed or one[0] in reasons]
    params = [param_data(name, stmt, file) for name, stmt, file, _ in shown]
    fixed = [{"name": name, "reason": reason} for name, reason in reasons.items()]
    return PageProgram(data, params, fixed, tuple(writer.shapes), tuple(writer.paints))


@cache
def _stage() -> Json:
    """The usual stage, and of each argument of its words the renderers' field, its kind and its range."""
    usual, fields = {**stage_data(Stage()), "sky": stage_data(Sky())}, {}
    usual["light"]["radius"], usual["ground"]["fade"], usual["camera"]["exposure"] = 0.0, FADE, 1.0
    for name, word in words.STAGE.items():
        schema = getattr(scene, name.capitalize()).model_json_schema()["properties"].values()
        least = [one.get("minimum", one.get("exclusiveMinimum", -MOST)) for one in schema]
        ranges = [(low, one.get("maximum", MOST)) for low, one in zip(least, schema, strict=True)]
        columns = zip(usual[name], word.kinds, ranges, strict=True)
        fields[name] = [(field, kind, *ends) for field, kind, ends in columns]
    return {"usual": usual, "fields": fields}


def param_data(name: str, stmt: nodes.Param, file: FileContext) -> dict[str, Any]:
    """The data of a param for its control on a page."""
    value = file.value(stmt.name.text)
    colour = "color" if is_colour(stmt.default) else "vector"
    kind = colour if isinstance(value, Vec) else _KINDS[value.__class__]
    data: dict[str, Any] = {"name": name, "kind": kind, "value": _json(value)}
    if stmt.range is not None:
        allowed = prepare(stmt.range, Site(file, file.scope, "file")).run(file.env)
        if isinstance(allowed, Vec):
            data["choices"] = _json(allowed)
        elif isinstance(allowed, RangeValue) and allowed.step is not None:
            # it may go downwards, and need not reach its end
            low, high = sorted((allowed.start, allowed.at(max(0, allowed.count() - 1))))
            data |= {"low": low, "high": high, "step": abs(allowed.step)}
        elif isinstance(allowed, RangeValue):
            data |= {"low": allowed.start, "high": allowed.stop}
            data |= {"exclusive": True} if allowed.exclusive else {}
    if isinstance(value, Angle | Time):
        units = (node.unit for node in nodes.walk(stmt.default) if isinstance(node, nodes.NumberLiteral))
        data["unit"] = next(filter(None, units), "deg" if isinstance(value, Angle) else "s")
    if label := _LABEL.match(stmt.span.source.text, (stmt.range or stmt.default).span.end):
        data["label"] = label[1].strip()
    return data


def _json(value: Any) -> Json:
    if isinstance(value, Vec):
        return [_json(item) for item in value.items]
    return value if isinstance(value, bool | str) else unpack(value)[0]
