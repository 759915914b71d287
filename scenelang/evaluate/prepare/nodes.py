"""Statements that make nodes: geometries, groups, booleans, chains and module calls."""

from __future__ import annotations

from typing import Any

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder, ChainBuilder, make
from scenelang.evaluate.costs import MODULE_CALL, OBJECT
from scenelang.evaluate.names import Definition, Env
from scenelang.evaluate.prepare.blocks import (
    Action,
    Body,
    Place,
    inner,
    misplaced,
    prepare_block,
    prepare_statement,
)
from scenelang.evaluate.prepare.expressions import prepare
from scenelang.evaluate.prepare.references import entering, lookup
from scenelang.evaluate.report.undefined import VALUES
from scenelang.evaluate.session import Session
from scenelang.scene import library, spans
from scenelang.scene.schema import MAX_NODE_DEPTH, Boolean, Chain, Group, Material, Object
from scenelang.syntax import nodes
from scenelang.words import LANGUAGE

HOLDERS = ("file", "group", "chain", "unknown")


def holds_children(place: Place, span: Span, what: str) -> bool:
    """Whether children may stand here; reports it if not."""
    if place.kind in HOLDERS:
        return True
    if place.kind == "material":
        misplaced(place, span, f"{what} inside a material", "a material's block holds texture operations")
    else:
        help = "a block of an object or a call holds transforms and a material; use group { … } for children"
        misplaced(place, span, f"{what} inside an object", help)
    return False


def place_child(node: Any, where: spans.Place, out: Builder, session: Session) -> None:
    """Hand a finished node to the block it stands in."""
    session.spans.record(node, where, session.report.calls)
    session.count_parts(1, where.name)
    join_child(node, where, out, session)


def join_child(node: Any, where: spans.Place, out: Builder, session: Session) -> None:
    """Append ``node`` to its block, which must not have transforms yet."""
    if out.moved is not None:
        session.report.error(
            "E0331",
            "a child after a transform",
            where.name,
            labels=(Label(out.moved, "applies to all children"),),
            help="put children first; a transform for some of them goes with them into group { … }",
        )
    out.add(node)
    if session.watch is not None:
        session.watch(where.statement, node)


# ---------------------------------------------------------------- objects


def prepare_object(stmt: nodes.Call, place: Place) -> Action | None:
    """``GEOMETRY { … }`` with a geometry that the model has."""
    unit = place.unit
    name, session = stmt.name.text, unit.session
    fits = holds_children(place, stmt.name.span, f"object `{name}`")
    body = Body((), 1)
    if stmt.body is not None:
        body = prepare_block(stmt.body.statements, inner(place, "object"), stmt.body.span)
    if stmt.args:
        for arg in stmt.args:
            prepare(arg.value, unit, place.scope)
        if not fits:
            return None
        help = f"size it in its block: {name} {{ scale(0.5); }}"
        if name == "square":
            help += f'; its sides are sqrt(2) long, those of rect(w, h) in "{library.SHAPES}" as written'
        session.report.error("E0308", f"`{name}` takes no arguments", stmt.args[0].span, help=help)
        return None
    if not fits:
        return None
    where, actions, weight = spans.Place(stmt.name.span, stmt.span), body.actions, body.weight
    unit.weight += OBJECT

    def action(env: Env, out: Builder) -> None:
        inside = Builder()
        session.tick(weight, where.name)
        for act in actions:
            act(env, inside)
        session.count_object(where.name)
        node = make(
            Object,
            {
                "kind": "object",
                "geometry": name,
                "transforms": tuple(inside.transforms),
                "material": inside.material,
            },
        )
        place_child(node, where, out, session)

    return action


# ---------------------------------------------------------------- groups, booleans, chains


def prepare_node(stmt: nodes.Node, place: Place) -> Action | None:
    fits = holds_children(place, stmt.keyword, f"`{stmt.kind}`")
    chain = stmt.kind == "chain"
    around = inner(place, "chain" if chain else "group")
    if chain:
        _check_first(stmt, place)
    body = prepare_block(stmt.body.statements, around, stmt.body.span)
    if not fits:
        return None
    session, where = place.unit.session, spans.Place(stmt.keyword, stmt.span)

    def action(env: Env, out: Builder) -> None:
        inside = ChainBuilder() if chain else Builder()
        run_body(body, env, inside, session, where.name)
        node = _finish(stmt.kind, inside, inside.transforms, inside.material)
        place_child(node, where, out, session)

    return action


def run_body(body: Body, env: Env, inside: Builder, session: Session, span: Span) -> None:
    """Run a block one level further down."""
    session.node_depth += 1
    if session.node_depth > MAX_NODE_DEPTH:
        raise session.halt("E0321", f"groups nested deeper than {MAX_NODE_DEPTH}", span)
    session.tick(body.weight, span)
    for act in body.actions:
        act(env, inside)
    session.node_depth -= 1


def _finish(kind: str, inside: Builder, transforms: list[Any], material: Material | None) -> Any:
    fields: dict[str, Any] = {
        "children": tuple(inside.children),
        "transforms": tuple(transforms),
        "material": material,
    }
    if kind == "group":
        return make(Group, {"kind": "group", **fields})
    if kind == "chain":
        return make(Chain, {"kind": "chain", **fields})
    return make(Boolean, {"kind": "boolean", "op": kind, **fields})


# ---------------------------------------------------------------- chains


def _check_first(stmt: nodes.Node, place: Place) -> None:
    """The first child that a chain names outright joins nothing and carries no word."""
    for child in stmt.body.statements:
        if isinstance(child, nodes.Combined):
            word = child.keyword
            edit = Edit(Span(word.source, word.start, child.child.span.start), "")
            fix = Fix(f"remove `{child.op}`", (edit,)) if child.op in ("union", "smooth") else None
            help = None if fix else "what it is taken from or cut with stands before it"
            message = f"`{child.op}` on the first child of a chain joins it to nothing"
            place.unit.session.report.error("E0335", message, word, help=help, fix=fix)
            return
        if isinstance(child, nodes.Call | nodes.Node | nodes.For | nodes.If):
            return


def prepare_combined(stmt: nodes.Combined, place: Place) -> Action | None:
    session, op = place.unit.session, stmt.op
    if place.kind not in ("chain", "unknown"):
        help = "put the children into chain { … }, or write a boolean node: " + op + " { … }"
        misplaced(place, stmt.keyword, f"`{op}` before a child outside a chain", help)
        prepare_statement(stmt.child, Place(place.unit, place.scope, "unknown", place.nested))
        return None
    if not _makes_child(stmt.child, place):
        message = f"`{op}` before a statement that makes no object"
        misplaced(place, stmt.keyword, message, "the word joins one object or node to those before it")
        return None
    child = prepare_statement(stmt.child, place)
    if child is None:
        return None
    act = child

    def action(env: Env, out: Builder) -> None:
        if not isinstance(out, ChainBuilder):
            return
        if not out.children and op in ("subtract", "intersect"):
            session.report.error("E0335", f"`{op}` with nothing before it", stmt.keyword)
        out.op = op if out.children else "union"
        act(env, out)
        out.op = "union"

    return action


def _makes_child(stmt: nodes.Stmt, place: Place) -> bool:
    """Whether a statement after a boolean word is an object, a node or a call of a module."""
    if isinstance(stmt, nodes.Call):
        binding = lookup(stmt.name, place.unit, place.scope)
        return stmt.name.text not in LANGUAGE and (binding is None or binding.kind not in VALUES)
    return isinstance(stmt, nodes.Node)


# ---------------------------------------------------------------- modules


def prepare_module_call(stmt: nodes.Call, definition: Definition, place: Place) -> Action | None:
    """``NAME(1);`` or ``NAME(1) { transforms }``: one child, whatever the module holds."""
    unit, session = place.unit, place.unit.session
    fits = holds_children(place, stmt.name.span, f"a call of module `{stmt.name.text}`")
    codes = {id(arg): prepare(arg.value, unit, place.scope) for arg in stmt.args or ()}
    block = None
    if stmt.body is not None:
        block = prepare_block(stmt.body.statements, inner(place, "object"), stmt.body.span)
    enter = entering(stmt.name, stmt.args or (), definition, codes, unit, place.scope)
    if enter is None or not fits:
        return None
    where = spans.Place(stmt.name.span, stmt.span)
    unit.weight += MODULE_CALL

    def action(env: Env, out: Builder) -> None:
        before = session.report.calls
        frame = enter(env)
        inside = Builder()
        run_body(Body(definition.run, 1), frame, inside, session, where.name)
        session.report.calls = before
        session.depth -= 1
        transforms, material = inside.transforms, inside.material
        if block is not None:
            own = Builder()
            session.tick(block.weight, where.name)
            for act in block.actions:
                act(env, own)
            transforms = [*transforms, *own.transforms]
            material = material or own.material
        if len(inside.children) != 1:
            place_child(_finish("group", inside, transforms, material), where, out, session)
            return
        child = inside.children[0]
        if transforms or (material is not None and child.material is None):
            moved = make(
                child.__class__,
                {
                    **child.__dict__,
                    "transforms": (*child.transforms, *transforms),
                    "material": child.material or material,
                },
            )
            session.spans.copy(child, moved)
            child = moved
        join_child(child, where, out, session)

    return action
