"""Statements that make nodes: geometries, groups, booleans, chains and module calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder, ChainBuilder, make
from scenelang.evaluate.costs import MODULE_CALL, OBJECT
from scenelang.evaluate.file_context import Action, Place
from scenelang.evaluate.names import Definition, Env
from scenelang.evaluate.prepare.blocks import Body, misplaced, prepare_inner, prepare_statement
from scenelang.evaluate.prepare.calls import bind, entering
from scenelang.evaluate.prepare.expressions import guarded, prepare_arguments
from scenelang.evaluate.prepare.references import lookup
from scenelang.evaluate.report.undefined import VALUES
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.functions import number
from scenelang.evaluate.values.value import POISON, Problem, show
from scenelang.scene import library
from scenelang.scene.schema import MAX_NODE_DEPTH, Boolean, Chain, Group, Material, Object
from scenelang.scene.spans import Written
from scenelang.syntax import nodes
from scenelang.words import KEYWORDS, LANGUAGE

HOLDERS = ("file", "group", "chain", "unknown")


def holds_children(place: Place, span: Span, what: str, name: str) -> bool:
    """Whether children may stand here; reports it if not."""
    if place.kind in HOLDERS:
        return True
    if place.kind == "material":
        help = "a material's block holds texture operations"
        misplaced(place, span, f"{what} inside a material", name, help)
    else:
        help = "a block of an object or a call holds transforms and a material; use group { … } for children"
        misplaced(place, span, f"{what} inside an object", name, help)
    return False


def place_child(node: Any, where: Written, out: Builder, session: Session) -> None:
    """Hand a finished node to the block it stands in."""
    session.spans.record(node, where, session.report.calls)
    session.count_parts(1, where.name)
    _join_child(node, where, out, session)


def _join_child(node: Any, where: Written, out: Builder, session: Session) -> None:
    """Append ``node`` to its block, which must not have transforms yet."""
    if out.moved is not None:
        labels = (Label(out.moved, "applies to all children"),)
        help = "put children first; a transform for some of them goes with them into group { … }"
        session.report.error("E0331", "a child after a transform", where.name, labels=labels, help=help)
    out.add(node)
    if session.watch is not None:
        session.watch(where.statement, node)


# ---------------------------------------------------------------- objects


def prepare_object(stmt: nodes.Call, place: Place, geometry: str | None = None) -> Action | None:
    """``GEOMETRY { … }`` with a geometry that the model has, or one of its own."""
    name, session, where = stmt.name.text, place.session, Written(stmt.name.span, stmt.span)
    fits = holds_children(place, where.name, "object `{}`", name)
    body = prepare_inner(stmt.body, place.inner("object"))
    if stmt.args:
        prepare_arguments(stmt.args, place)
        if fits:
            help = f"size it in its block: {name} {{ scale(0.5); }}"
            if name == "square":
                help += f'; its sides are sqrt(2) long, those of rect(w, h) in "{library.SHAPES}" as written'
            session.report.error("E0308", f"`{name}` takes no arguments", stmt.args[0].span, help=help)
        return None
    if not fits:
        return None
    place.file.weight += OBJECT

    def action(env: Env, out: Builder) -> None:
        inside = Builder()
        body.run(env, inside, session, where.name)
        session.count_objects(1, where.name)
        fields = {
            "kind": "object",
            "geometry": geometry or name,
            "transforms": tuple(inside.transforms),
            "material": inside.material,
        }
        place_child(make(Object, fields), where, out, session)

    return action


# ---------------------------------------------------------------- groups, booleans, chains


def prepare_node(stmt: nodes.Node, place: Place) -> Action | None:
    fits = holds_children(place, stmt.keyword, "`{}`", stmt.kind)
    chain = stmt.kind == "chain"
    if chain:
        _check_first(stmt, place)
    width = _width(stmt, place)
    body = prepare_inner(stmt.body, place.inner("chain" if chain else "group"))
    if not fits:
        return None
    session, where = place.session, Written(stmt.keyword, stmt.span)

    def action(env: Env, out: Builder) -> None:
        inside = ChainBuilder() if chain else Builder()
        _run_nested(body, env, inside, session, where.name)
        node = _finish(stmt.kind, inside, inside.transforms, inside.material, width(env))
        place_child(node, where, out, session)

    return action


def _run_nested(body: Body, env: Env, inside: Builder, session: Session, span: Span) -> None:
    """Run a block one level further down."""
    session.node_depth += 1
    if session.node_depth > MAX_NODE_DEPTH:
        raise session.halt("E0321", f"groups nested deeper than {MAX_NODE_DEPTH}", span)
    body.run(env, inside, session, span)
    session.node_depth -= 1


def _width(stmt: nodes.Node | nodes.Combined, place: Place) -> Callable[[Env], float | None]:
    """The k of a word that joins, None where none is written."""
    word = KEYWORDS[stmt.op if isinstance(stmt, nodes.Combined) else stmt.kind]
    given = prepare_arguments(stmt.args, place)
    bound = bind(place.report, nodes.Name(stmt.keyword, word.name), word.params, word.required, given)
    if not bound or bound[0] is None:
        return lambda env: None
    get, operand = bound[0].code.run, bound[0].arg.value
    check = guarded(place, _above_0, operand.span, (operand,))

    def run(env: Env) -> float | None:
        k = check(get(env))
        return None if k is POISON else float(k)

    return run


def _above_0(k: Any) -> float:
    if number(k) <= 0.0:
        raise Problem("E0311", f"a blend of width {show(k)} is not above 0", operand=0)
    return float(k)


def _finish(
    kind: str, inside: Builder, transforms: list[Any], material: Material | None, k: float | None = None
) -> Any:
    fields: dict[str, Any] = {
        "children": tuple(inside.children),
        "transforms": tuple(transforms),
        "material": material,
    }
    if kind in ("group", "chain"):
        return make(Group if kind == "group" else Chain, {"kind": kind, **fields})
    return make(Boolean, {"kind": "boolean", "op": kind, **fields, "k": k})


# ---------------------------------------------------------------- chains


def _check_first(stmt: nodes.Node, place: Place) -> None:
    """The first child that a chain names outright joins nothing and carries no word."""
    makers = (nodes.Combined, nodes.Call, nodes.Node, nodes.For, nodes.If)
    child = next((child for child in stmt.body.statements if isinstance(child, makers)), None)
    if isinstance(child, nodes.Combined):
        word = child.keyword
        edit = Edit(Span(word.source, word.start, child.child.span.start), "")
        fix = Fix(f"remove `{child.op}`", (edit,)) if child.op in ("union", "smooth") else None
        help = None if fix else "what it is taken from or cut with stands before it"
        message = f"`{child.op}` on the first child of a chain joins it to nothing"
        place.report.error("E0335", message, word, help=help, fix=fix)


def prepare_combined(stmt: nodes.Combined, place: Place) -> Action | None:
    report, op, width = place.report, stmt.op, _width(stmt, place)
    if place.kind not in ("chain", "unknown"):
        help = f"put the children into chain {{ … }}, or write a boolean node: {op} {{ … }}"
        misplaced(place, stmt.keyword, "`{}` before a child outside a chain", op, help)
        prepare_statement(stmt.child, Place(place.file, place.scope, "unknown", place.nested))
        return None
    if not _makes_child(stmt.child, place):
        help = "the word joins one object or node to those before it"
        misplaced(place, stmt.keyword, "`{}` before a statement that makes no object", op, help)
        return None
    act = prepare_statement(stmt.child, place)
    if act is None:
        return None

    def action(env: Env, out: Builder) -> None:
        if not isinstance(out, ChainBuilder):
            return
        if not out.children and op in ("subtract", "intersect"):
            report.error("E0335", f"`{op}` with nothing before it", stmt.keyword)
        if out.children:
            out.op, out.k = op, width(env)
        act(env, out)
        out.op, out.k = "union", None

    return action


def _makes_child(stmt: nodes.Stmt, place: Place) -> bool:
    """Whether a statement after a boolean word is an object, a node or a call of a module."""
    if isinstance(stmt, nodes.Call):
        binding = lookup(stmt.name, place)
        return stmt.name.text not in LANGUAGE and (binding is None or binding.kind not in VALUES)
    return isinstance(stmt, nodes.Node)


# ---------------------------------------------------------------- modules


def prepare_module_call(stmt: nodes.Call, definition: Definition, place: Place) -> Action | None:
    """``NAME(1);`` or ``NAME(1) { transforms }``: one child, whatever the module holds."""
    session, where = place.session, Written(stmt.name.span, stmt.span)
    fits = holds_children(place, where.name, "a call of module `{}`", stmt.name.text)
    given = prepare_arguments(stmt.args, place)
    block = prepare_inner(stmt.body, place.inner("object")) if stmt.body is not None else None
    enter = entering(stmt.name, given, definition, place)
    if enter is None or not fits:
        return None
    place.file.weight += MODULE_CALL

    def action(env: Env, out: Builder) -> None:
        before = session.report.calls
        frame = enter(env)
        inside = Builder()
        _run_nested(Body(definition.run, 1), frame, inside, session, where.name)
        session.report.calls = before
        session.depth -= 1
        place_called(inside, block, env, where, out, session)

    return action


def place_called(
    inside: Builder, block: Body | None, env: Env, where: Written, out: Builder, session: Session
) -> None:
    """Hand what a call has made to the block it stands in, moved as the call's own block says."""
    transforms, material = inside.transforms, inside.material
    if block is not None:
        own = Builder()
        block.run(env, own, session, where.name)
        transforms = [*transforms, *own.transforms]
        material = material or own.material
    if len(inside.children) != 1:
        place_child(_finish("group", inside, transforms, material), where, out, session)
        return
    child = inside.children[0]
    if transforms or (material is not None and child.material is None):
        moved = (*child.transforms, *transforms)
        fields = {**child.__dict__, "transforms": moved, "material": child.material or material}
        changed = make(child.__class__, fields)
        session.spans.copy(child, changed)
        child = changed
    _join_child(child, where, out, session)
