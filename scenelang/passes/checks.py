"""Passes that only report: chains that a model cannot hold, and what it was not trained for."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import dist, hypot, inf, sqrt, tan
from operator import attrgetter, itemgetter

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.graph import affine
from scenelang.graph.chain import LevelsError, split_levels
from scenelang.graph.geometries import GEOMETRIES
from scenelang.graph.nodes import Graph, Leaf, Row, leaves
from scenelang.graph.space import REACH, Space
from scenelang.graph.steps import Affine, Displace, Step, Twist, Warp
from scenelang.passes.context import Context


def check_levels(graph: Graph, context: Context) -> Graph:
    """Report objects whose deformations or affine maps the model cannot hold; the graph is unchanged.

    Before: the normal form of `fold_warps`.
    """
    check = partial(_check, space=graph.space, context=context)
    for leaf in leaves(graph.root):
        leaf.noted("check_levels", check)
    return graph


def _check(leaf: Leaf, space: Space, context: Context) -> None:
    manifest = context.manifest
    if manifest.lifting == "exact" and any(not isinstance(move.step, Affine) for move in leaf.moves):
        try:  # other liftings take any chain
            split_levels(leaf.steps, manifest.limits, space)
        except LevelsError as error:
            inner, outer = manifest.limits.get("inner_warps", 0), manifest.limits.get("outer_warps", 0)
            fact = f"the deformations of `{leaf.geometry}` do not fit model `{manifest.name}`: {error}"
            help = (
                f"the model holds up to {inner} deformations, an affine map, up to {outer} deformations "
                "and an affine map; a `twirl` merges with the deformation after it, also across rotations "
                "and uniform scales about the origin"
            )
            context.diagnostics.add("E0506", fact, leaf.span, labels=_places(leaf), help=help)
            return
    # Each map is lifted by itself, so each needs an inverse, and so does what they compose to.
    maps = [step.rows for step in leaf.steps if isinstance(step, Affine)]
    maps += [affine.composed(leaf.steps)] if len(maps) > 1 else []
    bad = next((rows for rows in maps if not space.usable(rows)), None)
    if bad is not None:
        smallest, largest = space.stretches(bad)
        fact = f"the transforms of `{leaf.geometry}` compose to a singular one, which stretches by "
        fact, help = f"{fact}{smallest:.3g} to {largest:.3g}", "scale less along one direction, or less often"
    elif not all(_mild(move.step) for move in leaf.moves):
        fact, help = f"the deformations of `{leaf.geometry}` compose to one beyond float32", "deform less"
    else:
        return
    context.diagnostics.add("E0406", fact, leaf.span, labels=_places(leaf), help=help)


def _mild(step: Step) -> bool:
    if isinstance(step, Warp):
        return abs(step.twirl) < REACH and hypot(*step.bend) < REACH
    if isinstance(step, Twist):
        return abs(step.twist) < REACH
    return isinstance(step, Affine) or max(abs(step.amount), abs(step.frequency)) < REACH


def _places(leaf: Leaf) -> list[Label]:
    found: list[Label] = []
    seen: set[Span] = {leaf.span} if leaf.span else set()
    for move in leaf.moves:
        if move.span is not None and move.span not in seen:
            seen.add(move.span)
            what = "affine from here on" if isinstance(move.step, Affine) else "deforms here"
            found.append(Label(move.span, what))
    return found[:8]


Measures = list[tuple[str, float]]

_CODES = {
    "objects": "W0501",
    "twirl": "W0502",
    "bend": "W0503",
    "scale": "W0504",
    "smooth": "W0505",
    "thin": "W0506",
    "thickness": "W0506",
    "blend": "W0507",
    "twist": "W0509",
    "displace": "W0510",
    "frequency": "W0510",
    "texels": "W0511",
    "width": "W0512",
}
_SUBJECTS = {
    "twirl": "a `twirl` of {value} on {name}",
    "bend": "a `bend` of {value} on {name}",
    "twist": "a `twist` of {value} on {name}",
    "displace": "a displacement of {value} of {name}",
    "frequency": "a displacement of frequency {value} of {name}",
    "scale": "a scale of {value} of {name}",
    "thin": "{name}, {value} times as long as wide,",
    "thickness": "{name}, {value} thick,",
    "texels": "a texture of {value} texels to a pixel on {name}",
}
"""What is said of an object, in the order of the warnings."""
_WRONG = "twirl", "bend", "twist", "displace", "frequency", "scale", "thin"
WILD = 100  # times the largest measured value of these pictures may be wrong all over
_TOLERANCE = 1e-9


def check_trained(graph: Graph, context: Context) -> Graph:
    """Warn once for each quantity outside its trained or measured range, at the object furthest out.

    Deformations are measured in the normal form, per unit length of the space they act in; the scale of an
    object is each of the two stretches of its affine maps, and how thin it is their ratio; of an opaque solid
    it is how thick it is where it is thinnest. A texture's texels are counted where they are densest; of a
    solid at its centre.

    Before: STREAM. After: unchanged.
    """
    rows, trained = graph.rows(), context.manifest.trained
    measures = partial(_measures, space=graph.space)
    outside: dict[str, list[tuple[float, float, Leaf]]] = {}  # (by how much, value, object)
    for _, leaf, _, _, _, cuts in rows:
        for quantity, value in (*leaf.noted("measures", measures), *_texels(leaf, graph)):
            if quantity in trained and not (quantity == "thickness" and cuts):
                low, high = trained[quantity]
                above = value - high if quantity != "thickness" else 0.0  # of which more does no harm
                excess = max(low - value, above) / ((high - low) or 1.0)
                if excess > _TOLERANCE:
                    outside.setdefault(quantity, []).append((excess, value, leaf))
    for quantity, subject in _SUBJECTS.items():
        if found := outside.get(quantity):
            _, value, leaf = max(found, key=itemgetter(0))
            more = len({id(leaf) for *_, leaf in found}) - 1
            said = subject.format(name=f"`{leaf.geometry}`", value=f"{value:.3g}")
            others = f", as {more:,} more {'are' if more > 1 else 'is'}" if more else ""
            _warn(context, quantity, f"{said} is outside the measured range {{}}{others}", leaf, value)
    widest = max((row for row in rows if row.op != "union"), key=attrgetter("k"), default=None)
    if widest is not None and "width" in trained and widest.k > trained["width"][1]:
        fact = f"a `{widest.op}` of width {widest.k:.3g} is outside the measured range {{}}"
        _warn(context, "width", fact, widest.leaf)
    smooth = [row.leaf for row in rows if row.op == "smooth"]
    if "smooth" in trained and len(smooth) > trained["smooth"][1]:
        fact = f"{len(smooth):,} smooth unions are outside the measured range {{}}"
        _warn(context, "smooth", fact, smooth[-1])
    if smooth and "blend" in trained:
        _check_blends(rows, measures, context)
    if "objects" in trained and len(rows) > trained["objects"][1]:
        fact = f"{len(rows):,} objects are outside the measured range {{}}"
        _warn(context, "objects", fact, rows[-1].leaf)
    return graph


def _check_blends(rows: list[Row], measures: Callable[[Leaf], Measures], context: Context) -> None:
    """Warn at the `smooth` whose colours lie furthest apart for its size.

    Where a blend's distances are off, by a share of the objects' scale, its colour is off by that share of
    what the colours differ by: the product of both tells the error.
    """
    low, high, largest = [1.0] * 3, [0.0] * 3, 0.0
    worst: tuple[float, float, float, Leaf] | None = None
    for op, leaf, *_, cuts in rows:
        if cuts or op == "intersect":
            continue
        largest = max(largest, leaf.noted("measures", measures)[0][1])
        rgb = leaf.look.colour()
        dark = rgb if leaf.look.element is None else (0.0, 0.0, 0.0)  # a texture may have any colour
        low, high = list(map(min, low, dark)), list(map(max, high, rgb))
        if op == "smooth":
            contrast = max(max(c - a, b - c) for a, b, c in zip(low, high, rgb, strict=True))
            if worst is None or contrast * largest > worst[0]:
                worst = contrast * largest, contrast, largest, leaf
    if worst is not None and worst[0] > context.manifest.trained["blend"][1]:
        product, contrast, scale, leaf = worst
        said = f"a `smooth` of colours {contrast:.2g} apart at a scale of {scale:.3g}"
        _warn(context, "blend", f"{said}: the product {product:.3g} is outside the measured range {{}}", leaf)


def _measures(leaf: Leaf, space: Space) -> Measures:
    smallest, largest = space.stretches(affine.composed(leaf.steps))
    found = [("scale", smallest), ("scale", largest)]
    if smallest > 0:
        found.append(("thin", largest / smallest))
    if leaf.look.material == "diffuse":
        row = GEOMETRIES.get(leaf.geometry)
        found.append(("thickness", smallest * (row.thickness if row else inf)))
    for step in leaf.steps:
        if isinstance(step, Warp):
            if step.twirl:
                found.append(("twirl", step.twirl))
            if step.bend != (0.0, 0.0):
                found.append(("bend", hypot(*step.bend)))
        elif isinstance(step, Twist):
            found.append(("twist", step.twist))
        elif isinstance(step, Displace):
            found += [("displace", abs(step.amount)), ("frequency", abs(step.frequency))]
    return found


def _texels(leaf: Leaf, graph: Graph) -> Measures:
    """Texels of a picture to a pixel."""
    element, affines = leaf.look.element, affine.composed(leaf.steps)
    if element is None or element.dimension == 3:
        return []
    a, b, c, _, d, e, f, *_ = affine.inverted(affine.compose(affines, leaf.look.moved))
    p, q, r = a * a + b * b + c * c, a * d + b * e + c * f, d * d + e * e + f * f
    texels = max(element.sizes) / 2 * sqrt((p + r) / 2 + hypot((p - r) / 2, q))  # to a unit of the world
    pixel = 2 / min(graph.canvas)
    if graph.stage is not None:
        camera = graph.stage.camera
        pixel *= dist(camera.eye, affines[3::4]) * tan(camera.fov_rad / 2)
    return [("texels", texels * pixel)]


def _warn(context: Context, quantity: str, message: str, leaf: Leaf, value: float = 0.0) -> None:
    low, high = context.manifest.trained[quantity]
    figures = context.manifest.measured.get("stability", {}).get(quantity)
    doubt = "the picture may be less exact than the model's figures"
    fact = message.format(f"{low:g} to {high:g} of model `{context.manifest.name}`")
    help = f"measured there: {figures}" if figures else doubt
    if quantity in _WRONG and abs(value) > WILD * high:
        help = f"it is more than {WILD} times what was measured: nothing of the picture may be right"
    context.diagnostics.add(_CODES[quantity], fact, leaf.span, help=help)
