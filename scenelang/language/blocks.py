"""Blocks and control flow, and the statements that make nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple

from scenelang.assets.element import POINTS, Points, points_fault
from scenelang.assets.records import Record
from scenelang.language import expressions, library, tree
from scenelang.language.builder import Action, Builder, ChainBuilder, Site, make
from scenelang.language.diagnostics import Edit, Fix, Label, Span, did_you_mean, listing
from scenelang.language.expressions import Code, bind, condition, guarded, prepare
from scenelang.language.library import SpanMap, Written
from scenelang.language.limits import CALL_STEPS, HALF_STEPS, MAX_NESTING, MODULE_CALL, OBJECT
from scenelang.language.nodes import blend_width
from scenelang.language.scene import MAX_NODE_DEPTH, Boolean, Chain, Group, Material, Object, objects_of
from scenelang.language.scopes import VALUES, head_of
from scenelang.language.session import UNBOUND, Binding, Definition, Env, Needs, Scope, Session, Slots
from scenelang.language.values import MAX_VECTOR, POISON, Problem, RangeValue, Vec, number, show, unexpected
from scenelang.language.words import KEYWORDS, LANGUAGE, OUTLINES, SETTINGS


class PreparedBlock(NamedTuple):
    """A prepared block, and what a run of it costs."""

    actions: Iterable[Action] = ()
    weight: int = 1

    def run(self, env: Env, out: Builder, session: Session, span: Span) -> None:
        """Run the block, whose steps count at ``span``."""
        session.tick(self.weight, span)
        for act in self.actions:
            act(env, out)


def prepare_statement(stmt: tree.Stmt, place: Site) -> Action | None:
    """One statement's action; None where it does nothing when it runs."""
    place.file.weight += HALF_STEPS.get(stmt.__class__, 0)
    action: Action | None = place.session.statements[stmt.__class__](stmt, place)
    return action


def prepare_block(statements: Sequence[tree.Stmt], place: Site, span: Span) -> PreparedBlock:
    """Prepare a block in its own scope, which ``place`` brings along; bodies of fns and modules last."""
    file, scope = place.file, place.scope
    file.nesting += 1
    if file.nesting > MAX_NESTING:
        raise file.session.halt("E0324", f"a tree of more than {MAX_NESTING} levels", span)
    before = file.weight
    declared = [_declare(stmt, place) for stmt in statements if isinstance(stmt, tree.Fn | tree.Module)]
    bodies = [prepare_body for prepare_body in declared if prepare_body is not None]
    for stmt in statements:
        if isinstance(stmt, tree.Let | tree.Param):
            scope.later.setdefault(stmt.name.text, stmt.name.span)
        elif isinstance(stmt, tree.Import):
            scope.later.setdefault(stmt.alias.text, stmt.alias.span)
    prepared = [_collected(stmt, place) for stmt in statements]
    scope.later.clear()
    actions = [action for action in prepared if action is not None]
    if bodies and not (scope.slots.root is not None and scope is file.scope):
        actions = _unbind(scope) + actions
    for prepare_body in bodies:
        prepare_body()
    file.nesting -= 1
    weight, file.weight = file.weight - before, before  # whoever runs the block counts it
    return PreparedBlock(tuple(actions), 1 + len(actions) + weight // 2)


def prepare_inner(block: tree.Block | None, place: Site) -> PreparedBlock:
    """Prepare a block of a statement, with the place inside it; nothing to run where there is none."""
    return PreparedBlock() if block is None else prepare_block(block.statements, place, block.span)


def _collected(stmt: tree.Stmt, place: Site) -> Action | None:
    """`prepare_statement`, noting dependencies; what no frame changes, in a file or its groups, runs once."""
    session = place.session
    if not session.replays or place.repeated or place.scope.slots.root is None:
        return prepare_statement(stmt, place)
    around, session.needs = session.needs, Needs()
    try:
        action = prepare_statement(stmt, place)
        needs = session.needs
    finally:
        around.on.append(session.needs)
        session.needs = around
    fills = isinstance(stmt, tree.Call | tree.Node | tree.For | tree.If)
    setting = isinstance(stmt, tree.Call) and stmt.name.text in SETTINGS
    if action is None or not fills or setting or place.kind not in ("file", "group"):
        return action
    return Replayed(action, needs, session, stmt.span)


def _unbind(scope: Scope) -> list[Action]:
    """In a loop, a function must not see what the pass before left in a slot."""
    slots = [b.slot for b in scope.names.values() if b.kind == "let" and b.slots is scope.slots]

    def action(env: Env, out: Builder) -> None:
        for slot in slots:
            env[slot] = UNBOUND

    return [action] if slots else []


def misplaced(place: Site, span: Span, fact: str, name: str = "", help: str | None = None) -> None:
    """Report a statement in the wrong place by a ``fact`` with ``{}`` for its name, once in a block."""
    if place.kind != "unknown":
        key = ("E0330", span.source, span) if place.block is None else ("E0330", place.block, fact)
        place.report.error_once(key, "E0330", fact.format(name), span, help=help)


def define(name: tree.Name, binding: Binding, place: Site) -> bool:
    """Bind a name in this scope; reports a second definition and keeps the first."""
    scope = place.scope
    earlier = scope.names.get(name.text)
    scope.later.pop(name.text, None)
    if place.report.damage(name.span.source).holds(name.span):
        # What it stands for is known when its statement reads again.
        binding.kind = "poison"
    elif earlier is not None:
        message = f"`{name.text}` is already defined in this scope"
        help = "names are bound once; an inner block may bind them anew"
        labels = earlier.labels("first defined here")
        place.report.error("E0202", message, name.span, labels=labels, help=help)
        return False
    scope.names[name.text] = binding
    return True


def prepare_let(stmt: tree.Let, place: Site) -> Action | None:
    code = prepare(stmt.value, place)
    name, session, slots = stmt.name.span, place.session, place.scope.slots
    slot, known = slots.add(), code.value is not expressions.VARIES
    value = code.value if known else None
    define(stmt.name, Binding("let", name, slots, slot, value, known, session.needs), place)
    get, watch = code.run, session.watch

    def action(env: Env, out: Builder) -> None:
        env[slot] = get(env)
        if watch is not None:
            watch(name, env[slot])

    return action


def _declare(stmt: tree.Fn | tree.Module, place: Site) -> Callable[[], None] | None:
    """Make a function or module known; returns how to prepare its body."""
    name, outer = stmt.name, place.scope.slots
    if isinstance(stmt, tree.Module) and name.text in LANGUAGE:
        message = f"`{name.text}` is a word of the language and names no module"
        place.report.error("E0209", message, name.span, help="rename it")
        return None
    definition = Definition(stmt, outer)
    binding = Binding("fn" if isinstance(stmt, tree.Fn) else "module", name.span, value=definition)
    define(name, binding, place)
    return lambda: _prepare_body(stmt, definition, place)


def _prepare_body(stmt: tree.Fn | tree.Module, definition: Definition, place: Site) -> None:
    file, report, session = place.file, place.report, place.session
    slots = Slots(definition.outer, owner=stmt.name.span)
    inside = Site(file, Scope(slots, place.scope), "group")
    defaults: list[Callable[[Env], Any]] = []
    places = [slots.add() for _ in stmt.params]
    optional = False
    for param, slot in zip(stmt.params, places, strict=True):
        at = param.name.span
        if param.default is not None:
            optional = True
            defaults.append(prepare(param.default, inside).run)
        else:
            if optional:
                message = f"`{param.name.text}` has no default but follows one that has"
                report.error("E0308", message, param.span, help="put it first, or give it a default")
            defaults.append(lambda env: POISON)
        define(param.name, Binding("argument", at, slots, slot), inside)
    definition.defaults = tuple(defaults)
    before = file.weight
    around, session.needs = session.needs, definition.needs
    if isinstance(stmt, tree.Fn):
        definition.run = prepare(stmt.body, inside).run
        definition.weight = CALL_STEPS + (file.weight - before) // 2
        file.weight = before
    else:
        body = prepare_inner(stmt.body, inside._replace(scope=Scope(slots, inside.scope)))
        definition.run, definition.weight = body
    session.needs = around
    definition.size = slots.size


def _items(value: Any) -> Any:
    if value.__class__ is Vec:
        return value.items
    if value.__class__ is RangeValue:
        if value.unit != "number" and value.step is None:
            help = "add a step, as in 0deg..90deg step 30deg"
            raise Problem("E0311", f"a range of {value.unit}s without a step", help)
        value.count()
        return value
    advice = "write 0..<n for n passes" if value.__class__ is float else None
    raise unexpected("a range or a vector", value, advice)


def _prepare_loop(stmt: tree.For | tree.ForItem, place: Site) -> tuple[Callable[[Env], Any], int, Site]:
    """How to get what a loop runs over, the slot of its variable, and the place inside it."""
    get = prepare(stmt.iterable, place).run
    loop = place.inner()._replace(repeated=True)
    slot = loop.scope.slots.add()
    define(stmt.variable, Binding("loop", stmt.variable.span, loop.scope.slots, slot), loop)
    check = guarded(place, _items, stmt.iterable.span, (), item_steps=0)
    return lambda env: check(get(env)), slot, loop


def prepare_vector(expr: tree.Vector, place: Site) -> Code:
    """Prepare a vector; with loops in it the items of each run are counted before it is made."""
    if not any(isinstance(item, tree.ForItem | tree.IfItem) for item in expr.items):
        return expressions.computed(place, _vector, expr.span, expr.items, item_steps=0)
    fills = [_prepare_item(item, place) for item in expr.items]
    make = guarded(place, lambda items: Vec(tuple(items)), expr.span, (), item_steps=0)

    def run(env: Env) -> Any:
        items: list[Any] = []
        return make(items) if all(fill(env, items) for fill in fills) else POISON

    return Code(run)


def _vector(*items: Any) -> Vec:
    for index, item in enumerate(items):
        if item.__class__ is RangeValue:
            raise Problem("E0301", "a range inside a vector", "write it without brackets", index)
    return Vec(items)


def _prepare_item(item: tree.Expr, place: Site) -> Callable[[Env, list[Any]], bool]:
    """Prepare how an item adds its values to those of a vector; false where one of them is poison."""
    session, file = place.session, place.file
    if isinstance(item, tree.IfItem):
        test, then = condition(item.condition, place).run, _prepare_item(item.body, place)

        def chosen(env: Env, out: list[Any]) -> bool:
            value = test(env)
            return then(env, out) if value is True else value is False

        return chosen
    if isinstance(item, tree.ForItem):
        values_of, slot, loop = _prepare_loop(item, place)
        name, before = item.variable.span, file.weight
        fill = _prepare_item(item.body, loop)
        weight, file.weight = 2 + (file.weight - before) // 2, before + HALF_STEPS[tree.For]

        def repeated(env: Env, out: list[Any]) -> bool:
            values = values_of(env)
            for value in values if values is not POISON else ():
                env[slot] = value
                if session.watch is not None:
                    session.watch(name, value)
                session.tick(weight, item.iterable.span)
                if not fill(env, out):
                    return False
                if len(out) > MAX_VECTOR:  # which is reported where the vector is made
                    break
            return values is not POISON

        return repeated
    get, check = prepare(item, place).run, guarded(place, _vector, item.span, (item,), item_steps=0)

    def one(env: Env, out: list[Any]) -> bool:
        value = get(env)
        if value is POISON or (value.__class__ is RangeValue and check(value) is POISON):
            return False
        out.append(value)
        return True

    return one


def prepare_for(stmt: tree.For, place: Site) -> Action | None:
    values_of, slot, loop = _prepare_loop(stmt, place)
    actions, weight = prepare_inner(stmt.body, loop.inner())
    session, span = place.session, stmt.iterable.span

    def action(env: Env, out: Builder) -> None:
        values = values_of(env)
        if values is POISON:
            return
        for value in values:
            env[slot] = value
            if session.watch is not None:
                session.watch(stmt.variable.span, value)
            session.tick(weight + 1, span)
            for act in actions:
                act(env, out)

    return action


def prepare_if(stmt: tree.If, place: Site) -> Action | None:
    arms: list[tuple[Callable[[Env], Any], PreparedBlock]] = []
    at: tree.If | tree.Block | None = stmt
    while isinstance(at, tree.If):
        test = condition(at.condition, place).run
        arms.append((test, prepare_inner(at.then, place.inner())))
        at = at.otherwise
    last = prepare_inner(at, place.inner()) if at is not None else None
    session, span = place.session, stmt.condition.span

    def action(env: Env, out: Builder) -> None:
        chosen = last
        for test, body in arms:
            value = test(env)
            if value is True:
                chosen = body
                break
            if value is POISON:
                return
        if chosen is not None:
            chosen.run(env, out, session, span)

    return action


class Replayed(Record, frozen=False):
    """The action of a statement of a file or a group that runs at most once in a frame."""

    action: Callable[[Any, Builder], None]
    needs: Needs
    session: Session
    span: Span
    varies: bool | None = None  # whether frames change it, once that was asked
    kept: tuple[Builder, SpanMap, int, int, int] | None = None  # what it added; steps, objects and parts

    def __call__(self, env: Any, out: Builder) -> None:
        """Run the statement, or replay what it did."""
        if self.varies is None:
            self.varies = self.needs.varies()
        session, kept = self.session, self.kept
        clashes = kept and ((kept[0].children and out.moved) or (kept[0].material and out.material))
        if self.varies or clashes:  # an error needs the place it stands in
            self.action(env, out)
        elif kept is None:
            own = Builder(out.material, out.material_span, out.moved)
            steps, objects, parts = session.steps, session.objects, session.parts
            around, session.spans = session.spans, SpanMap()
            try:
                self.action(env, own)
            finally:
                around.add(session.spans)
                spans, session.spans = session.spans, around
            own.material = own.material if out.material is None else None
            own.moved = own.moved if own.transforms else None
            self.kept = own, spans, session.steps - steps, session.objects - objects, session.parts - parts
            out.extend(own)
        else:
            own, spans, steps, objects, parts = kept
            session.tick(steps, self.span)
            session.count_parts(parts, self.span)
            session.count_objects(objects, self.span)
            session.spans.add(spans)
            out.extend(own)


HOLDERS = ("file", "group", "chain", "unknown")


def holds_children(place: Site, span: Span, what: str, name: str) -> bool:
    """Test whether children may stand here, and report it if not."""
    if place.kind in HOLDERS:
        return True
    within, help = "a material", "a material's block holds texture operations"
    if place.kind != "material":
        help = "a block of an object or a call holds transforms and a material; use group { … } for children"
        within = "an object"
    misplaced(place, span, f"{what} inside {within}", name, help)
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


_SIDES: Final = {
    "square": ("sqrt(2)", "rect(w, h)", library.SHAPES),
    "box": ("2 / sqrt(3)", "block(w, h, d)", library.SOLIDS),
}
"""Leaves, how long their sides are, and what of the library takes sides."""


def _points(value: Any) -> Points:
    """The points of a polygon or a spline; raises Problem, whose operand is 0, or 1 on for a point."""
    if value.__class__ is not Vec:
        help = 'a regular one is polygon(n, r) of "std/shapes"' if value.__class__ is float else None
        raise unexpected("a vector of points [x, y]", value, help, 0)
    for at, item in enumerate(value.items[: POINTS[-1] + 1], 1):  # of more their number is reported
        if item.__class__ is not Vec or [part.__class__ for part in item.items] != [float, float]:
            raise unexpected("a point [x, y]", item, "points are vectors of two numbers", at)
    points = tuple([item.items for item in value.items[: POINTS[-1] + 1]])
    if (fault := points_fault(points, len(value.items))) is not None:
        raise Problem("E0311", fault, "it takes 3 to 1,000 points that span an area", 0)
    return points


def _prepare_points(stmt: tree.Call, place: Site) -> Callable[[Env], Any] | None:
    """The points that a polygon or a spline is called with; None after a report."""
    word, given = OUTLINES[stmt.name.text], expressions.prepare_arguments(stmt.args, place)
    bound = bind(place.report, stmt.name, word.params, word.required, given)
    if not bound or bound[0] is None:
        return None
    get, written = bound[0].code.run, bound[0].arg.value
    items = written.items if isinstance(written, tree.Vector) else ()
    if any(isinstance(item, tree.ForItem | tree.IfItem) for item in items):
        items = ()
    check = guarded(place, _points, written.span, (written, *items), item_steps=1)
    return lambda env: check(get(env))


def prepare_object(stmt: tree.Call, place: Site, geometry: str | None = None) -> Action | None:
    """``GEOMETRY { … }`` with a geometry that the model has, or one of its own; or one by its points."""
    name, session, where = stmt.name.text, place.session, Written(stmt.name.span, stmt.span)
    fits, by_points = holds_children(place, where.name, "object `{}`", name), name in OUTLINES
    body = prepare_inner(stmt.body, place.inner("object")._replace(by_points=by_points))
    points_of = _prepare_points(stmt, place) if by_points else lambda env: ()
    if stmt.args and not by_points:
        expressions.prepare_arguments(stmt.args, place)
        if fits:
            help = f"size it in its block: {name} {{ scale(0.5); }}"
            sides, written, path = _SIDES.get(name, ("", "", ""))
            if sides:
                help += f'; its sides are {sides} long, those of {written} in "{path}" as written'
            fix = None
            if name in ("sphere", "disc") and len(stmt.args) == 1 and stmt.body is None:
                rest = Span(where.name.source, where.name.end, stmt.span.end)
                scaled = f" {{ scale({stmt.args[0].value.span.text}); }}"
                fix = Fix("put it into its block", (Edit(rest, scaled),))
            message = f"`{name}` takes no arguments"
            session.report.error("E0308", message, stmt.args[0].span, help=help, fix=fix)
        return None
    if not fits or points_of is None:
        return None
    place.file.weight += OBJECT

    def action(env: Env, out: Builder) -> None:
        inside = Builder()
        body.run(env, inside, session, where.name)
        if (points := points_of(env)) is POISON:
            return
        session.count_objects(1, where.name)
        fields: dict[str, Any] = {"kind": "object", "geometry": geometry or name}
        fields |= {"transforms": tuple(inside.transforms), "material": inside.material, "points": points}
        place_child(make(Object, fields), where, out, session)

    return action


def prepare_node(stmt: tree.Node, place: Site) -> Action | None:
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


def _run_nested(body: PreparedBlock, env: Env, inside: Builder, session: Session, span: Span) -> None:
    """Run a block one level further down."""
    session.node_depth += 1
    if session.node_depth > MAX_NODE_DEPTH:
        raise session.halt("E0321", f"groups nested deeper than {MAX_NODE_DEPTH}", span)
    body.run(env, inside, session, span)
    session.node_depth -= 1


def _width(stmt: tree.Node | tree.Combined, place: Site) -> Callable[[Env], float | None]:
    """The k of a word that joins, None where none is written."""
    op = stmt.op if isinstance(stmt, tree.Combined) else stmt.kind
    word = KEYWORDS[op]
    given = expressions.prepare_arguments(stmt.args, place)
    bound = bind(place.report, tree.Name(stmt.keyword, word.name), word.params, word.required, given)
    if not bound or bound[0] is None:
        return lambda env: None
    get, operand = bound[0].code.run, bound[0].arg.value

    def above_0(k: Any) -> float:
        if number(k) <= 0.0:
            raise Problem("E0311", f"a blend of width {show(k)} is not above 0", operand=0)
        return float(k)

    check = guarded(place, above_0, operand.span, (operand,))

    def run(env: Env) -> float | None:
        k = check(get(env))
        return None if k is POISON else blend_width(op, float(k))

    return run


def _finish(
    kind: str, inside: Builder, transforms: list[Any], material: Material | None, k: float | None = None
) -> Any:
    fields = {"children": tuple(inside.children), "transforms": tuple(transforms), "material": material}
    if kind in ("group", "chain"):
        return make(Group if kind == "group" else Chain, {"kind": kind, **fields})
    return make(Boolean, {"kind": "boolean", "op": kind, **fields, "k": k})


def _check_first(stmt: tree.Node, place: Site) -> None:
    """The first child that a chain names outright joins nothing and carries no word."""
    makers = (tree.Combined, tree.Call, tree.Node, tree.For, tree.If)
    child = next((child for child in stmt.body.statements if isinstance(child, makers)), None)
    if isinstance(child, tree.Combined):
        word = child.keyword
        edit = Edit(Span(word.source, word.start, child.child.span.start), "")
        fix = Fix(f"remove `{child.op}`", (edit,)) if child.op in ("union", "smooth") else None
        help = None if fix else "what it is taken from or cut with stands before it"
        message = f"`{child.op}` on the first child of a chain joins it to nothing"
        place.report.error("E0335", message, word, help=help, fix=fix)


def prepare_combined(stmt: tree.Combined, place: Site) -> Action | None:
    report, op, width = place.report, stmt.op, _width(stmt, place)
    if place.kind not in ("chain", "unknown"):
        help = f"put the children into chain {{ … }}, or write a boolean node: {op} {{ … }}"
        misplaced(place, stmt.keyword, "`{}` before a child outside a chain", op, help)
        prepare_statement(stmt.child, Site(place.file, place.scope, "unknown", place.nested))
        return None
    child, makes = stmt.child, isinstance(stmt.child, tree.Node)
    if isinstance(child, tree.Call):
        binding = expressions.lookup(child.name, place)
        head = head_of(child, binding, place.kind)
        makes = head == "leaf" or (head == "own" and binding is not None and binding.kind not in VALUES)
    if not makes:
        help = "the word joins one object or node to those before it"
        misplaced(place, stmt.keyword, "`{}` before a statement that makes no object", op, help)
        return None
    if (act := prepare_statement(child, place)) is None:
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


def prepare_module_call(stmt: tree.Call, definition: Definition, place: Site) -> Action | None:
    """``NAME(1);`` or ``NAME(1) { transforms }``: one child, whatever the module holds."""
    session, where = place.session, Written(stmt.name.span, stmt.span)
    fits = holds_children(place, where.name, "a call of module `{}`", stmt.name.text)
    given = expressions.prepare_arguments(stmt.args, place)
    block = prepare_inner(stmt.body, place.inner("object")) if stmt.body is not None else None
    if (enter := expressions.entering(stmt.name, given, definition, place)) is None or not fits:
        return None
    place.file.weight += MODULE_CALL

    def action(env: Env, out: Builder) -> None:
        before = session.report.calls
        frame = enter(env)
        inside = Builder()
        _run_nested(PreparedBlock(definition.run, 1), frame, inside, session, where.name)
        session.report.calls = before
        session.depth -= 1
        place_called(inside, block, env, where, out, session)

    return action


def place_called(
    inside: Builder, block: PreparedBlock | None, env: Env, where: Written, out: Builder, session: Session
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


def prepare_element(stmt: tree.Call, place: Site, called: str) -> Action | None:
    """A statement headed by the name of a geometry or a group, which a Scene calls ``called``."""
    alias, _, name = called.partition(".")
    file = next(file for file in place.session.elements.values() if file.name == alias)
    zoo = file.zoo
    assert zoo is not None
    groups, geometries = zoo.groups, zoo.geometries
    if stmt.args is None or (stmt.args and name not in groups):
        if name in geometries:
            return prepare_object(stmt, place, called)
        _missing(stmt, place, "geometry", [*geometries], f"its group is {stmt.name.text}() {{ … }}")
        return None
    session, where = place.session, Written(stmt.name.span, stmt.span)
    fits = holds_children(place, where.name, "group `{}`", stmt.name.text)
    block = prepare_inner(stmt.body, place.inner("object")) if stmt.body is not None else None
    if name not in groups:
        _missing(stmt, place, "group", [*groups], f"its geometry is {stmt.name.text} {{ … }}")
        return None
    if stmt.args:
        expressions.prepare_arguments(stmt.args, place)
        help = f"move it in its block: {stmt.name.text}() {{ scale(0.5); }}"
        message = f"group `{stmt.name.text}` takes no arguments"
        place.report.error("E0308", message, stmt.args[0].span, help=help)
        return None
    if not fits:
        return None
    count = len(groups[name])
    place.file.weight += MODULE_CALL + OBJECT * count

    def action(env: Env, out: Builder) -> None:
        inside = Builder()
        session.count_objects(count, where.name)
        for part in objects_of(zoo, alias, name):
            place_child(part, where, inside, session)
        place_called(inside, block, env, where, out, session)

    return action


def _missing(stmt: tree.Call, place: Site, what: str, known: list[str], otherwise: str) -> None:
    """Report a name that stands only for the other of a geometry and a group."""
    alias, _, name = stmt.name.text.partition(".")
    last = Span(stmt.name.span.source, stmt.name.span.end - len(name), stmt.name.span.end)
    help, fix = did_you_mean(name, known, last, effort=place.report.effort)
    there = f"; it has {listing(known)}" if known and help is None else ""
    message = f"`{alias}` has no {what} `{name}`"
    place.report.error("E0212", message, last, help=f"{help or otherwise}{there}", fix=fix)
