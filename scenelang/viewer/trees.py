"""Syntax trees as JSON: the expressions and statements of a form.

A scene without mistakes is taken for granted. What the page's model does not have is ``["no", why]``, which
matters where it runs: it may stand in a branch that is never taken.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from scenelang.elements.element import Element
from scenelang.elements.textures import load_textures
from scenelang.evaluate.file_context import FileContext
from scenelang.evaluate.values.functions import CONSTANTS
from scenelang.evaluate.values.value import COMPONENTS, Vec
from scenelang.models.manifest import Manifest
from scenelang.scene.elements import Brought
from scenelang.scene.groups import objects_of
from scenelang.scene.schema import Color, Matrix, Object, Scale, Translate
from scenelang.syntax import nodes
from scenelang.viewer.names import Bound, Json, Names, Scope, bind
from scenelang.words import (
    ANIMATED,
    FUNCTIONS,
    LANGUAGE,
    OPERATIONS,
    SETTINGS,
    SOLID_TRANSFORMS,
    STAGE,
    TRANSFORMS,
)

_VALUES: Final = ("let", "param", "argument", "loop")


class Lacking(Exception):
    """The page's model does not have what is named; the message says what."""


class Writer(Names):
    """Writes a scene's statements.

    Args:
        context: of the scene's file, prepared.
        manifest: the model that draws the page.
        elements: what rows name first.

    Attributes:
        shapes, paints: elements that rows name.
    """

    def __init__(self, context: FileContext, manifest: Manifest, elements: Iterable[Element]) -> None:
        super().__init__()
        self.manifest, listed = manifest, list(elements)
        self.files = {file.name: file.zoo for file in context.session.elements.values()}
        self.brought = Brought.of(tuple(context.session.elements.values()))
        self.textures = load_textures()
        self.shapes = [element for element in listed if not element.material]
        self.paints = [element for element in listed if element.material]

    # ------------------------------------------------------------ expressions

    def expression(self, expr: nodes.Expr, scope: Scope) -> Json:
        """An expression: a number, a boolean, or a word and what it works on."""
        match expr:
            case nodes.Number():
                return [expr.unit, plain(expr.value)] if expr.unit else plain(expr.value)
            case nodes.Bool():
                return expr.value
            case nodes.String():
                return ["'", expr.value]
            case nodes.Color():
                return ["#", *(round(255 * part) for part in expr.rgb)]
            case nodes.Vector():
                return ["[", *self.given(expr.items, scope)]
            case nodes.Range():
                ends = self.given((expr.start, expr.stop, expr.step), scope)
                return ["..", int(expr.exclusive), *ends[: 2 if expr.step is None else 3]]
            case nodes.NameRef():
                return self._name(expr.name.text, scope)
            case nodes.Unary():
                inner = self.expression(expr.operand, scope)
                negative = expr.op == "-" and type(inner) in (int, float) and inner
                return -inner if negative else [f"{expr.op}1", inner]
            case nodes.Binary():
                return [expr.op, self.expression(expr.left, scope), self.expression(expr.right, scope)]
            case nodes.Conditional():
                return ["?", *self.given((expr.condition, expr.then, expr.otherwise), scope)]
            case nodes.CallExpr():
                return self._function(expr, scope)
            case nodes.Index():
                return ["@", self.expression(expr.value, scope), self.expression(expr.index, scope)]
            case nodes.Member():
                return self._member(expr, scope)
            case nodes.MaterialExpr():
                return self._material(expr, scope)
        raise TypeError(f"no form of {expr.__class__.__name__}")

    def _name(self, name: str, scope: Scope) -> Json:
        bound = scope.find(name)
        if bound is not None:
            return self.value(bound, scope)
        if name in ANIMATED:
            return ["t", [*ANIMATED].index(name)]
        value = CONSTANTS[name]
        if isinstance(value, Vec):
            return ["[", *map(plain, value.items)]
        return ["none"] if value is None else value

    def _member(self, expr: nodes.Member, scope: Scope) -> Json:
        alias = scope.find(expr.value.name.text) if isinstance(expr.value, nodes.NameRef) else None
        if alias is not None and alias.inside is not None:
            return self.value(alias.inside.names[expr.name.text], scope)
        return [".", self.expression(expr.value, scope), COMPONENTS[expr.name.text]]

    def _function(self, expr: nodes.CallExpr, scope: Scope) -> Json:
        name, bound = expr.name.text, scope.find(expr.name.text)
        if bound is not None:
            return ["call", *self.call(bound, expr.args, scope)]
        word = FUNCTIONS[name]
        args = [arg.value for arg in expr.args] if word.variadic else bind(word.params, expr.args)
        return [name, *self.given(args, scope)]

    # ------------------------------------------------------------ materials

    def _material(self, written: nodes.MaterialExpr | nodes.MaterialUse, scope: Scope) -> Json:
        """``["material", place of how it is lit, place of its colours or -1, block]``."""
        try:
            lit, paint = self._look(written.name.text, written.shading, scope)
        except Lacking as lacking:
            return ["no", str(lacking)]
        ops = [] if written.body is None else self.block(written.body, scope, "material")
        return ["material", self.manifest.materials.index(lit), paint, ops]

    def _look(self, name: str, shading: nodes.Name | None, scope: Scope) -> tuple[str, int]:
        alias, dot, rest = name.partition(".")
        lit = self.manifest.materials[0] if shading is None else shading.text
        paint = -1
        if dot:
            file = scope.find(alias)
            assert file is not None
            assert file.file is not None
            paint = self._element(self.brought.materials[file.file.materials[rest]], self.paints, name)
        elif name in self.textures:
            paint = self._element(self.textures[name], self.paints, name)
        else:
            lit = name
        if lit not in self.manifest.materials:
            raise Lacking(f"model `{self.manifest.name}` has no material `{lit}`")
        return lit, paint

    def _element(self, element: Element, known: list[Element], name: str) -> int:
        if element not in known and element.kind not in self.manifest.elements:
            raise Lacking(f"model `{self.manifest.name}` does not draw `{name}`")
        if element not in known:
            known.append(element)
        return known.index(element)

    # ------------------------------------------------------------ statements

    def statement(self, stmt: nodes.Stmt, scope: Scope, kind: str) -> Json:
        """A statement in a kind of block; None where it does nothing when it runs."""
        match stmt:
            case nodes.Let():
                value = self.expression(stmt.value, scope)
                return [*self._define(stmt.name, "let", scope), value]
            case nodes.Param():
                given = self.given((stmt.default, stmt.range), scope)
                return ["param", self._define(stmt.name, "param", scope)[1], stmt.name.text, *given]
            case nodes.For():
                items, inside = self.expression(stmt.iterable, scope), Scope(scope.frame, scope)
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

    def _define(self, name: nodes.Name, kind: str, scope: Scope) -> list[Json]:
        """Whether a name's slot is one of files, and which."""
        slot = self.slot(scope)
        scope.names[name.text] = Bound(kind, scope, slot)
        return ["g" if scope.frame is None else "v", slot]

    def _width(self, stmt: nodes.Node | nodes.Combined, scope: Scope) -> Json:
        return self.given(bind(("k",), stmt.args), scope)[0]

    def _headed(self, stmt: nodes.Call, scope: Scope, kind: str) -> Json:
        name = stmt.name.text
        bound = None if name in LANGUAGE else scope.find(name)
        worn = bound is not None and bound.kind in _VALUES and stmt.args is None
        if name in SETTINGS and not worn and (bound is None or bound.kind != "module"):
            return self._setting(stmt, scope)
        if name in LANGUAGE:
            return self._move(stmt, scope, kind == "material")
        body = None if stmt.body is None else self.block(stmt.body, scope, "object")
        if bound is None:
            if name not in self.manifest.geometries:
                return ["no", f"model `{self.manifest.name}` has no geometry `{name}`"]
            return ["object", self.manifest.geometries.index(name), body or []]
        if bound.kind == "module":
            return ["module", *self.call(bound, stmt.args or (), scope), body or []]
        if bound.element:
            return self._brought(stmt, bound.element, body or [])
        ops = [] if stmt.body is None else self.block(stmt.body, scope, "material")
        return ["use", self.value(bound, scope), *([ops] if ops else [])]

    def _setting(self, stmt: nodes.Call, scope: Scope) -> Json:
        name, word = stmt.name.text, SETTINGS[stmt.name.text]
        args = self.given(bind(word.params, stmt.args), scope)
        if name in STAGE and self.manifest.dimension == 2:
            return ["no", f"model `{self.manifest.name}` is flat and has no {name}"]
        return None if name == "canvas" else [name, *args]

    def _move(self, stmt: nodes.Call, scope: Scope, inks: bool) -> Json:
        name, args = stmt.name.text, stmt.args or ()
        table = OPERATIONS if inks else TRANSFORMS
        if name not in table:
            return ["no", f"`{name}` does not stand here"]
        if name in SOLID_TRANSFORMS and self.manifest.dimension == 2:
            return ["no", f"`{name}` leaves the plane"]
        if name == "scale" and len(args) == 1 and (args[0].name is None or args[0].name.text == "s"):
            return ["move", "even", self.expression(args[0].value, scope)]
        return ["move", name, *self.given(bind(table[name].params, args), scope)]

    # ------------------------------------------------------------ elements

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
            element = self.brought.materials.get(name)
            paint = -1 if element is None else self._element(element, self.paints, name)
            lit = self.manifest.materials[0] if element is not None else name
            inks = [op.rgb for op in part.material.ops if isinstance(op, Color)]
            ops = [["move", "color", ["[", *map(plain, rgb)]] for rgb in inks]
            if lit not in self.manifest.materials:
                raise Lacking(f"model `{self.manifest.name}` has no material `{lit}`")
            lines.append(["use", ["material", self.manifest.materials.index(lit), paint, ops]])
        return ["object", self._shape(part.geometry), lines]


def plain(number: float) -> float:
    """The same number, short in JSON."""
    return int(number) if float(number).is_integer() and abs(number) < 1e15 else float(number)
