"""The order of the passes, `PASSES`, and those that report mistakes and leave the graph unchanged."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from itertools import product
from math import cos, dist, exp, hypot, inf, sin, sqrt, tan
from operator import itemgetter
from typing import Final, NamedTuple

from scenelang.assets.element import Element
from scenelang.assets.records import deep_stack
from scenelang.compiler import rewrites, steps
from scenelang.compiler.chain import LevelsError, split_levels
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.graph import (
    BLACK,
    Fold,
    Graph,
    Invariant,
    Leaf,
    Link,
    Sound,
    leaf_box,
    leaves,
    links_within,
    meet,
    overlap,
    verify,
)
from scenelang.compiler.lower import Memory, Spans, lower
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.rewrites import Context, cover_of, covered
from scenelang.compiler.spaces import EXTINCTION, REACH, Box, Space
from scenelang.compiler.steps import Affine, Skin, Step
from scenelang.language.diagnostics import Diagnostics, Label, Span, plural
from scenelang.language.scene import Scene


def check_levels(graph: Graph, context: Context) -> Graph:
    """Report objects whose chains in normal form the model cannot hold; the graph is unchanged."""
    check = partial(_check, space=graph.space, context=context)
    for leaf in leaves(graph.root):
        leaf.noted("check_levels", check)
    return graph


def _check(leaf: Leaf, space: Space, context: Context) -> None:
    manifest = context.manifest
    own = next((move for move in leaf.moves if isinstance(move.step, steps.Grow | steps.Shell)), None)
    if own is not None and not manifest.framed:
        fact = f"model `{manifest.name}` does not draw `{type(own.step).__name__.lower()}`"
        help = "leave `model` out, or draw with another one"
        context.diagnostics.add("E0506", fact, own.span or leaf.span, help=help)
    skin, row = Skin.of(leaf.steps), GEOMETRIES.get(leaf.geometry)
    deep = 1.0 if row is None else row.inner or row.thickness / 2  # no deeper than the disc or ball around it
    if own is not None and _nothing(skin, deep):
        fact, help = f"nothing is left of this `{leaf.called}`", "shrink it less, or make its shell thicker"
        context.diagnostics.add("W0404", fact, own.span or leaf.span, help=help)
    if manifest.lifting == "exact" and any(not isinstance(move.step, Affine) for move in leaf.moves):
        try:  # other liftings take any chain
            split_levels(leaf.steps, manifest.limits, space)
        except LevelsError as error:
            inner, outer = manifest.limits.get("inner_warps", 0), manifest.limits.get("outer_warps", 0)
            fact = f"the deformations of `{leaf.called}` do not fit model `{manifest.name}`: {error}"
            help = (
                f"the model holds up to {inner} deformations, an affine map, up to {outer} deformations "
                "and an affine map; a `twirl` merges with the deformation after it, also across rotations "
                "and uniform scales about the origin"
            )
            context.diagnostics.add("E0506", fact, leaf.span, labels=_places(leaf), help=help)
            return
    # Each map is lifted by itself, so each needs an inverse, and so does what they compose to.
    maps = [step.rows for step in leaf.steps if isinstance(step, Affine)]
    maps += [steps.composed(leaf.steps)] if len(maps) > 1 else []
    bad = next((rows for rows in maps if not space.usable(rows)), None)
    if bad is not None:
        smallest, largest = space.stretches(bad)
        fact = f"the transforms of `{leaf.called}` compose to a singular one, which stretches by "
        fact, help = f"{fact}{smallest:.3g} to {largest:.3g}", "scale less along one direction, or less often"
    elif not all(_mild(move.step) for move in leaf.moves):
        fact, help = f"the deformations of `{leaf.called}` compose to one beyond float32", "deform less"
    else:
        return
    context.diagnostics.add("E0406", fact, leaf.span, labels=_places(leaf), help=help)


def _nothing(skin: Skin, depth: float) -> bool:
    """True where a skin provably leaves nothing of a leaf that is nowhere deeper than so many leaf units."""
    within = min(skin.level, skin.level - skin.inner) if skin.inner is not None else inf
    return min(skin.level + depth, within) + abs(skin.amount) <= 0.0


def _mild(step: Step) -> bool:
    if isinstance(step, steps.Warp):
        return abs(step.twirl) < REACH and hypot(*step.bend) < REACH
    if isinstance(step, steps.Twist):
        return abs(step.twist) < REACH
    return not isinstance(step, steps.Displace) or max(abs(step.amount), abs(step.frequency)) < REACH


def _places(leaf: Leaf) -> list[Label]:
    result: list[Label] = []
    seen: set[Span] = {leaf.span} if leaf.span else set()
    for move in leaf.moves:
        if move.span is not None and move.span not in seen:
            seen.add(move.span)
            what = "affine from here on" if isinstance(move.step, Affine) else "deforms here"
            result.append(Label(move.span, what))
    return result[:8]


Measures = list[tuple[str, float]]

_SUBJECTS = {
    "twirl": ("W0502", "a `twirl` of {value} on {name}"),
    "bend": ("W0503", "a `bend` of {value} on {name}"),
    "twist": ("W0509", "a `twist` of {value} on {name}"),
    "displace": ("W0510", "a displacement of {value} of {name}"),
    "frequency": ("W0510", "a displacement of frequency {value} of {name}"),
    "scale": ("W0504", "a scale of {value} of {name}"),
    "thin": ("W0506", "{name}, {value} times as long as wide,"),
    "thickness": ("W0506", "{name}, {value} thick,"),
    "wall": ("W0506", "{name}, {value} thick,"),
    "texels": ("W0511", "a texture of {value} texels to a pixel on {name}"),
}
"""Codes and subjects of warnings about an object, in the order of the warnings."""
_WRONG = "twirl", "bend", "twist", "displace", "frequency", "scale", "thin"
WILD = 100  # times the largest measured value of these pictures may be wrong all over
SMALL_LAMP: Final = 0.03  # world units; the light of lamps of a smaller radius is less exact in mist
_TOLERANCE = 1e-9


def check_trained(graph: Graph, context: Context) -> Graph:
    """Warn once for each quantity outside its trained or measured range, at the object furthest out.

    Deformations are measured in the normal form; the scale of an object is each of the two stretches of its
    affine maps, and how thin it is their ratio; an opaque solid is as thick as where it is thinnest, of what
    does not run out to a rim a wall, both in a view of the usual size; texels are
    counted where they are densest, of a solid at its centre. Before: STREAM. After: unchanged.
    """
    rows, trained = graph.rows(), context.manifest.trained
    measures = partial(_measures, space=graph.space)
    outside: dict[str, list[tuple[float, float, Leaf]]] = {}  # (by how much, value, object)
    letters = {name for name, element in graph.elements.items() if element.curved}
    for _, leaf, _, _, _, cuts in rows:
        exact = leaf.geometry in letters  # computed at any scale
        for quantity, value in (*leaf.noted("measures", measures), *_texels(leaf, graph)):
            thick = quantity in ("thickness", "wall")  # of which more does no harm
            if exact and quantity in ("scale", "thin"):
                continue
            if quantity in trained and not (thick and cuts):
                low, high = trained[quantity]
                value = value * graph.stage.growth if thick and graph.stage else value
                above = 0.0 if thick else value - high
                excess = max(low - value, above) / ((high - low) or 1.0)
                if excess > _TOLERANCE:
                    outside.setdefault(quantity, []).append((excess, value, leaf))
    for quantity, (code, subject) in _SUBJECTS.items():
        if result := outside.get(quantity):
            _, value, leaf = max(result, key=itemgetter(0))
            more = len({id(leaf) for *_, leaf in result}) - 1
            said = subject.format(name=f"`{leaf.called}`", value=f"{value:.3g}")
            others = f", as {more:,} more {'are' if more > 1 else 'is'}" if more else ""
            _warn(context, code, quantity, f"{said} is", leaf, value, others)
    smooth = [row.leaf for row in rows if row.op == "smooth"]
    if "smooth" in trained and len(smooth) > trained["smooth"][1]:
        _warn(context, "W0505", "smooth", f"{len(smooth):,} smooth unions are", smooth[-1])
    count = sum(leaf.geometry not in letters for _, leaf, *_ in rows)
    if "objects" in trained and count > trained["objects"][1]:
        _warn(context, "W0501", "objects", f"{count:,} objects are", rows[-1].leaf)
    return graph


def _measures(leaf: Leaf, space: Space) -> Measures:
    smallest, largest = space.stretches(steps.composed(leaf.steps))
    result = [("scale", smallest), ("scale", largest)]
    if smallest > 0:
        result.append(("thin", largest / smallest))
    skin, row = Skin.of(leaf.steps), GEOMETRIES.get(leaf.geometry)
    if leaf.look.material == "diffuse":
        grown = skin.grow if skin.order & 1 or not skin.shell else 0.0
        least = skin.shell or (row.thickness if row else inf)
        even = skin.shell or leaf.geometry in ("box", "cylinder")  # as thick all over
        result.append(("wall" if even else "thickness", smallest * (least + 2 * grown)))
    for step in leaf.steps:
        if isinstance(step, steps.Warp):
            if step.twirl:
                result.append(("twirl", step.twirl))
            if step.bend != (0.0, 0.0):
                result.append(("bend", hypot(*step.bend)))
        elif isinstance(step, steps.Twist):
            result.append(("twist", step.twist))
        elif isinstance(step, steps.Displace):
            result += [("displace", abs(step.amount)), ("frequency", abs(step.frequency))]
    return result


def _texels(leaf: Leaf, graph: Graph) -> Measures:
    """Texels to a pixel of the picture that an object wears, where they are densest."""
    element, affines = leaf.look.element, steps.composed(leaf.steps)
    if not isinstance(element, Element) or element.dimension == 3:
        return []
    a, b, c, _, d, e, f, *_ = steps.inverted(steps.compose(affines, leaf.look.moved))
    p, q, r = a * a + b * b + c * c, a * d + b * e + c * f, d * d + e * e + f * f
    texels = max(element.sizes) / 2 * sqrt((p + r) / 2 + hypot((p - r) / 2, q))  # to a unit of the world
    pixel = 2 / min(graph.canvas)
    if graph.stage is not None:
        camera = graph.stage.camera
        pixel *= dist(camera.eye, affines[3::4]) * tan(camera.fov_rad / 2)
    return [("texels", texels * pixel)]


def _warn(
    context: Context, code: str, quantity: str, said: str, leaf: Leaf, value: float = 0.0, others: str = ""
) -> None:
    low, high = context.manifest.trained[quantity]
    figures = context.manifest.measured.get("stability", {}).get(quantity)
    doubt = "the picture may be less exact than the model's figures"
    fact = f"{said} outside the measured range {low:g} to {high:g} of model `{context.manifest.name}`{others}"
    help = f"measured there: {figures}" if figures else doubt
    if quantity == "texels":
        help = "it lies on the leaf's own x and y: `scale` in the material's block makes it larger there"
    if quantity in _WRONG and abs(value) > WILD * high:
        help = f"it is more than {WILD} times what was measured: nothing of the picture may be right"
    context.diagnostics.add(code, fact, leaf.span, help=help)


Point = tuple[float, float, float]

_DIM: Final = 0.1
"""Share of the light; a medium around the eye that lets less through, in any direction, hides the scene."""


def check_eye(graph: Graph, context: Context) -> Graph:
    """Report an eye inside an opaque object, and warn of one deep in a medium, of a lamp that is wholly
    inside an opaque object and, under a sky, of a tiny one in a medium, by the exact fold there.

    Geometries without a formula count as far away. Before: STREAM. After: unchanged.
    """
    if graph.stage is None or not context.whole:
        return graph
    eye = graph.stage.camera.eye
    depth, holder = _folded(graph.root, eye, graph.space)
    if depth < 0.0 and holder is not None and holder.look.material != "volumetric":
        x, y, z = eye
        fact = f"the eye at [{x:g}, {y:g}, {z:g}] is inside this `{holder.geometry}`"
        context.diagnostics.add("E0408", fact, holder.span, help="move the camera or the object")
    elif (
        depth < 0.0
        and holder is not None
        and (through := exp((holder.look.density or EXTINCTION) * depth)) < _DIM
    ):
        x, y, z = eye
        fact = f"the eye at [{x:g}, {y:g}, {z:g}] is deep inside this `{holder.geometry}`, a medium"
        help = f"it lets {through:.2g} of the light through at most: move the camera or the object"
        context.diagnostics.add("W0403", fact, holder.span, help=help)
    lamps = [lamp for lamp in graph.stage.lights if lamp.power]
    for lamp in lamps if len(lamps) * len(graph.rows()) <= _TESTS else ():
        depth, holder = _folded(graph.root, lamp.position, graph.space)
        if depth >= 0.0 or holder is None:
            continue
        at = ", ".join(f"{v:g}" for v in lamp.position)
        mist = holder.look.material == "volumetric"
        if not mist and depth < -lamp.radius:
            fact = f"the lamp at [{at}] is inside this `{holder.geometry}`, which its light does not leave"
            help = "move one of them; what shines by itself has `glow(c, power)` in its material"
            context.diagnostics.add("W0407", fact, holder.span, help=help)
        elif mist and lamp.radius < SMALL_LAMP and graph.stage.sky is not None:
            fact = f"light under a `sky` may be wrong: the lamp at [{at}] is in the mist of this "
            fact += f"`{holder.geometry}`, and its radius of {lamp.radius:g} is below {SMALL_LAMP:g}"
            help = "compare with `render --backend reference`, which traces the light"
            context.diagnostics.add("W0514", fact, holder.span, help=help)
    return graph


_SIDES: Final = [tuple(sign * (i == axis) for i in range(3)) for axis in range(3) for sign in (1.0, -1.0)]
_MOST_SIDES: Final = 4  # of six, on which a solid has to be in a medium
_BESIDE: Final = 0.01  # of the way from a solid's middle to its surface


def check_media(graph: Graph, context: Context) -> Graph:
    """Warn of solids that a medium takes away, and of those that have its normals, by the exact fold.

    A medium takes what lies in it of all that is written before. On a solid that is written after it the
    fold's distance is still the medium's, which is deeper. Before: STREAM. After: unchanged.
    """
    rows, space = graph.rows(), graph.space
    media = [row.leaf for row in rows if row.leaf.look.material == "volumetric" and not row.cuts]
    if graph.stage is None or not context.whole or not media:
        return graph
    boxes, tests = [leaf_box(leaf, 0.0, space) for leaf in media], 0
    found: dict[str, list[tuple[Leaf, Leaf]]] = {"W0405": [], "W0406": []}
    for row in rows:
        leaf, box = row.leaf, leaf_box(row.leaf, 0.0, space)
        known = leaf.geometry in GEOMETRIES and leaf.look.material != "volumetric"
        if row.cuts or row.op == "intersect" or not known or not any(overlap(box, other) for other in boxes):
            continue
        tests += 2 * len(_SIDES) * len(rows)
        if tests > _TESTS:
            break
        around = list[tuple[str, Leaf]]()
        for within, beside in _sides(leaf, box):
            (inner, own), (outer, medium) = (_folded(graph.root, p, space) for p in (within, beside))
            lost = own is not None and own.look.material == "volumetric"
            medium = own if lost else medium
            if medium is None or medium.look.material != "volumetric" or (not lost and own is not leaf):
                continue
            depth = inner if lost else outer
            if depth < -dist(within, beside) and exp((medium.look.density or EXTINCTION) * depth) > _DIM:
                around.append(("W0405" if lost else "W0406", medium))
        for code, pairs in found.items():
            seen = [medium for kind, medium in around if kind == code]
            if len(seen) >= _MOST_SIDES and (code == "W0405" or leaf.look.glow == BLACK):
                pairs.append((leaf, seen[0]))
    for code, pairs in found.items():
        if pairs:
            leaf, medium = pairs[0]
            taken = f"is not seen, as the medium `{medium.geometry}` after it takes its place"
            lit = f"is lit as if it had the shape of the medium `{medium.geometry}` around it"
            more = f", as {plural(len(pairs) - 1, 'solid')} more" * (len(pairs) > 1)
            fact = f"this `{leaf.called}` {taken if code == 'W0405' else lit}{more}"
            labels = [Label(medium.span, "the medium")] if medium.span is not None else []
            help = f"carve it out: subtract {{ {medium.geometry} {{ … }} {leaf.geometry} {{ … }} }} beside it"
            context.diagnostics.add(code, fact, leaf.span, labels=labels, help=help)
    return graph


def _sides(leaf: Leaf, box: Box) -> Iterator[tuple[Point, Point]]:
    """Points inside and outside of a solid near its surface, on axes through a middle that is in it."""
    middle = steps.composed(leaf.steps)[3::4]
    reach = dist((box[0], box[1], box[4]), (box[2], box[3], box[5]))

    def at(way: Sequence[float], far: float) -> Point:
        x, y, z = (m + far * w for m, w in zip(middle, way, strict=True))
        return x, y, z

    def inside(p: Point) -> bool:
        return _distance(leaf.geometry, leaf.steps, p) < 0.0

    for way in _SIDES if inside(at(_SIDES[0], 0.0)) else ():
        near, far = 0.0, reach
        for _ in range(16):
            half = (near + far) / 2
            near, far = (half, far) if inside(at(way, half)) else (near, half)
        yield at(way, near * (1 - _BESIDE)), at(way, far * (1 + _BESIDE))


def _folded(fold: Fold, eye: Point, space: Space) -> tuple[float, Leaf | None]:
    """The distance of a fold at a point, and the leaf whose material is seen there."""
    depth, holder = inf, None
    for link in fold.links:
        node, k = link.node, link.width
        if isinstance(node, Fold):
            d, leaf = _folded(node, eye, space)
        elif node.geometry in GEOMETRIES:
            d, leaf = _distance(node.geometry, node.steps, eye), node
            d *= space.stretches(steps.composed(node.steps))[0]
        else:
            d, leaf = inf, None
        if link.op in ("subtract", "intersect"):
            cut = -d if link.op == "subtract" and leaf is not None else d
            depth = -_smooth(-depth, -cut, k)[0] if k else max(depth, cut)
        elif link.op == "smooth":
            depth, h = _smooth(depth, d, k)
            holder = leaf if h > 0.5 else holder
        else:
            holder = leaf if d < max(depth, 0.0) else holder
            depth = min(depth, d)
    return depth, holder


def _smooth(depth: float, d: float, k: float) -> tuple[float, float]:
    """The distance of a blend and the share, in [0, 1], of the operand ``d``."""
    if inf in (abs(depth), abs(d)):
        return min(depth, d), float(d < depth)
    h = min(max(0.5 + 0.5 * (depth - d) / k, 0.0), 1.0)
    return (d if h == 1.0 else depth + h * (d - depth)) - k * h * (1.0 - h), h


def _distance(geometry: str, chain: Sequence[Step], p: Point) -> float:
    """The leaf's own distance at a world point, with what its steps make of it."""
    for step in reversed(chain):
        x, y, z = p
        if isinstance(step, Affine):
            a, b, c, u, d, e, f, v, g, h, i, w = steps.inverted(step.rows)
            p = a * x + b * y + c * z + u, d * x + e * y + f * z + v, g * x + h * y + i * z + w
        elif isinstance(step, steps.Twist):
            s, c = sin(step.twist * y), cos(step.twist * y)
            p = c * x + s * z, y, c * z - s * x
        elif isinstance(step, steps.Warp):
            angle = step.twirl * hypot(x, y, z) + step.bend[0] * x + step.bend[1] * y
            s, c = sin(angle), cos(angle)
            p = c * x + s * y, c * y - s * x, z
    depth, (x, y, z) = float(GEOMETRIES[geometry].distance(p)), p
    for step in chain:
        if not isinstance(step, steps.Own):
            break
        if isinstance(step, steps.Grow):
            depth -= step.r
        elif isinstance(step, steps.Shell):
            depth = abs(depth) - step.w / 2
        else:
            f = step.frequency
            depth += step.amount * sin(f * x) * sin(f * y) * sin(f * z)
    return depth


_FAR: Final = 8.0
"""World units; larger coordinates and sizes were most likely meant as pixels."""
LABELLED: Final = 4  # objects that are shown of those that nobody sees
_TESTS: Final = 20_000
"""The most comparisons, as of boxes, beyond which nothing is reported, so that no scene takes long."""


def check_seen(graph: Graph, context: Context) -> Graph:
    """Warn where the picture provably shows only background or one plain object. STREAM is unchanged."""
    rows = graph.rows()
    if not context.whole or not rows:
        return graph
    boxes, cut = _left(graph)
    if boxes is None:
        return graph
    seen = [box for box in boxes if _in_sight(box, graph)]
    if context.moves and (seen or not boxes or not all(_is_far(box) for box in boxes)):
        return graph  # it may be in sight in another frame
    last = rows[-1].leaf
    if not boxes and cut is not None:
        fact = "nothing is left of the scene: the last cut takes all of it"
        _say(context, fact, cut, "let what is cut reach out of what cuts it, or what intersects meet")
    elif not seen:
        labels = [Label(row.leaf.span, "and this") for row in rows[1:LABELLED] if row.leaf.span]
        _say(context, *_unseen(graph, rows[0].leaf), labels)
    elif graph.stage is None and graph.root.links[-1] == Link("union", last) and last.look.plain:
        cover = cover_of(last, graph.space)
        if cover is not None and covered(graph.window(), [cover]):
            fact = f"this `{last.called}` covers the whole canvas: the picture has one colour"
            _say(context, fact, last.span, _units(graph, cover[0] > _FAR))
    return graph


def _say(context: Context, fact: str, span: Span | None, help: str, labels: Sequence[Label] = ()) -> None:
    context.diagnostics.add("W0402", fact, span, labels=labels, help=help)


def _left(graph: Graph) -> tuple[list[Box] | None, Span | None]:
    """Boxes around all that the fold leaves, None where they are not known, and the cut that left nothing."""
    widths = [link.width for link in links_within(graph.root) if link.op == "smooth"]
    felt, tests = sum(widths) / 4, 0  # a blend widens its operands by a quarter of its width at most

    def left(fold: Fold) -> tuple[list[Box] | None, Span | None]:
        nonlocal tests
        boxes, cut = list[Box](), None
        for link in fold.links:
            node, op = link.node, link.op
            own = [leaf_box(node, felt, graph.space)] if isinstance(node, Leaf) else left(node)[0]
            tests += len(boxes) * len(own or ())
            if own is None or tests > _TESTS:
                return None, None
            if op in ("union", "smooth"):
                boxes += own
            elif op == "intersect":
                pairs = (meet(a, b) for a, b in product(boxes, own))
                boxes = [shared for shared in pairs if shared is not None]
            elif not felt and isinstance(node, Leaf) and (disc := cover_of(node, graph.space)) is not None:
                boxes = [box for box in boxes if not covered(box, [disc])]
            cut = cut if boxes or cut is not None else node.span
        return boxes, None if boxes else cut

    return left(graph.root)


def _in_sight(box: Box, graph: Graph) -> bool:
    if (stage := graph.stage) is None:
        return overlap(box, graph.window())
    eye, (forward, right, up) = stage.camera.eye, stage.camera.axes()
    if stage.ground is not None and eye[1] > stage.ground.y > box[3]:
        return False
    side, reach = min(graph.canvas), tan(stage.camera.fov_rad / 2)
    wide, high = (reach * pixels / side for pixels in graph.canvas)
    planes: list[Sequence[float]] = [forward]
    for axis, half in ((right, wide), (up, high)):
        sides = [(half * f + a, half * f - a) for f, a in zip(forward, axis, strict=True)]
        planes += zip(*sides, strict=True)  # inward normals of two sides of the camera's frustum
    corners = [*product((box[0], box[2]), (box[1], box[3]), (box[4], box[5]))]
    return all(
        any(not sum(n * (p - e) for n, p, e in zip(plane, at, eye, strict=True)) < 0.0 for at in corners)
        for plane in planes
    )


def _is_far(box: Box) -> bool:
    return hypot((box[0] + box[2]) / 2, (box[1] + box[3]) / 2) > _FAR


def _unseen(graph: Graph, leaf: Leaf) -> tuple[str, Span | None, str]:
    """Message, place and help where everything lies out of sight."""
    if graph.stage is None:
        far = _is_far(leaf_box(leaf, 0.0, graph.space))
        return "everything lies off the canvas", leaf.span, _units(graph, far)
    camera = graph.stage.camera
    eye, target = (", ".join(f"{v:g}" for v in p) for p in (camera.eye, camera.target))
    help = f"the camera at [{eye}] looks at [{target}], and the ground hides what is below it; "
    return "no object is in sight", leaf.span, f"{help}move the objects, or turn the camera by `target`"


def _units(graph: Graph, pixels: bool) -> str:
    """Extent of the canvas, and how to write in pixels where those were likely meant."""
    width, height = graph.canvas
    side = min(width, height)
    shown = f"the canvas shows x from {-width / side:.3g} to {width / side:.3g}, y from {-height / side:.3g} "
    shown += f"to {height / side:.3g}"
    if not pixels:
        return shown
    group = f"group {{ … translate({-width / 2:g}, {-height / 2:g}); scale({2 / side:.6g}); }}"
    return f"{shown}, in units that are not pixels; to write in pixels put all objects into {group}"


class Pass(NamedTuple):
    """A step of the compiler and the invariants that hold after it, and ever after."""

    run: Callable[[Graph, Context], Graph]
    establishes: frozenset[Invariant] = frozenset()

    @property
    def name(self) -> str:
        """The name of its function and of its tests."""
        return self.run.__name__


PASSES: tuple[Pass, ...] = (
    Pass(rewrites.drop_empty, frozenset({Invariant.COMPOSITE})),
    Pass(rewrites.fold_looks, frozenset({Invariant.LOOKS})),
    Pass(rewrites.push_transforms, frozenset({Invariant.AT_LEAVES, Invariant.MERGED})),
    Pass(rewrites.fold_warps, frozenset({Invariant.NO_IDENTITIES})),
    Pass(check_levels),
    Pass(rewrites.flatten, frozenset({Invariant.STREAM})),
    Pass(check_eye),
    Pass(check_media),
    Pass(check_seen),
    Pass(rewrites.drop_unseen),
    Pass(rewrites.drop_hidden),
    Pass(check_trained),
)


OPTIONAL = frozenset({"drop_unseen", "drop_hidden"})
"""Passes that only save work: no later stage needs what they do."""


def check_scene(
    scene: Scene,
    spans: Spans | None,
    diagnostics: Diagnostics,
    manifest: Manifest,
    after: Callable[[str, Graph], None] | None = None,
    without: Collection[str] = (),
    memory: Memory | None = None,
) -> Graph:
    """Lower a scene, run the passes and verify the graph after each: the stream, sound without errors.

    ``after`` is called with ``"lower"`` and each pass's name and the graph it left; ``without`` names
    `OPTIONAL` passes, else ValueError is raised. No numpy is imported.
    """
    if not OPTIONAL.issuperset(without):
        raise ValueError(f"passes that cannot be left out: {', '.join(sorted(set(without) - OPTIONAL))}")
    after = after or (lambda name, graph: None)
    before, holds, sound = len(diagnostics.errors), frozenset[Invariant](), Sound()
    with deep_stack():
        graph = verify(lower(scene, manifest, spans, diagnostics, memory), "lower", sound=sound)
        whole, moves = len(diagnostics.errors) == before, scene.animation is not None
        context = Context(manifest, diagnostics, whole, moves)
        after("lower", graph)
        for step in PASSES:
            if step.name in without:
                continue
            given, graph = graph, step.run(graph, context)
            if graph is not given or step.establishes:
                holds |= step.establishes
                verify(graph, step.name, holds, sound)
            after(step.name, graph)
            if diagnostics.errors:
                if step.run is rewrites.flatten:
                    break  # all mistakes are reported, and the graph is not the scene's
                # Without sound chains no bound means anything: look for refusals only.
                context = Context(manifest, diagnostics, whole=False)
    return graph
