"""Scene to Graph: transforms become steps, materials become colours, names are checked against a model."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Final

from scenelang.assets.element import Element, Gradient, drawn_element
from scenelang.assets.element_file import load_textures
from scenelang.assets.records import Record
from scenelang.compiler import graph, steps
from scenelang.compiler.graph import BLACK, MOST_STEPS, Fold, Graph, Leaf, Link, Look, Move, coloured
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.spaces import PLANE, REACH, SHEET, SINGULAR, SPACES, Refusal, Space, decoded, stage_of
from scenelang.compiler.steps import IDENTITY, Affine, Own, Rows, Shell, Step, compose, inverted, scaling
from scenelang.language import nodes as schema
from scenelang.language import words
from scenelang.language.diagnostics import Diagnostics, Edit, Fix, Label, Span, listing
from scenelang.language.library import SpanMap, misfit
from scenelang.language.scene import Brought, Scene
from scenelang.language.words import SCENES, Combine

_STEPS: Final[dict[type, Callable[[Any], Step]]] = {
    schema.Flip: lambda flip: Affine(steps.scaling(-1.0, 1.0)),
    schema.Twirl: lambda twirl: steps.Warp(twirl.k, (0.0, 0.0)),
    schema.Bend: lambda bend: steps.Warp(0.0, (bend.k, 0.0)),
    schema.Twist: lambda twist: steps.Twist(twist.k),
    schema.Displace: lambda displace: steps.Displace(displace.amount, displace.frequency),
    schema.Grow: lambda grow: steps.Grow(grow.r),
    schema.Shell: lambda shell: steps.Shell(shell.w),
}
_MAPS: Final[dict[type, Callable[[Any], Rows]]] = {
    schema.Translate: lambda move: steps.translation(move.x, move.y, move.z),
    schema.Scale: lambda scale: steps.scaling(scale.x, scale.y, scale.z),
    schema.Rotate: lambda turn: steps.rotation(turn.angle, turn.axis),
    schema.Shear: lambda shear: steps.shearing(shear.axes, shear.k),
    schema.Matrix: lambda matrix: tuple([number for row in matrix.rows[:3] for number in row]),
}


def step_of(transform: schema.Transform | schema.Flip, space: Space) -> Step | Refusal:
    """The step of a transform, or the reason why there is none; in the plane scales along z drop out."""
    if (step := _STEPS.get(type(transform))) is not None:
        if transform.kind in words.SOLID_TRANSFORMS and space.dimension == 2:
            fact = f"`{transform.kind}` leaves the plane"
            return Refusal("E0505", fact, "bend the shape with `twirl` or `bend` instead")
        return step(transform)
    assert not isinstance(transform, schema.Flip)  # which `_STEPS` has
    fitted = space.fitted(transform, _MAPS[type(transform)](transform))
    if isinstance(fitted, Refusal):
        return fitted
    if space.usable(fitted):
        return Affine(fitted)
    (smallest, largest), singular = space.stretches(fitted), f"`{transform.kind}` is singular"
    if smallest <= SINGULAR * largest:
        fact = f"{singular}: it flattens everything to {space.thinner}"
        return Refusal("E0312", fact, "use factors other than 0")
    fact = f"{singular} in float32: it stretches by {smallest:.3g} to {largest:.3g}"
    return Refusal("E0312", fact, f"stretches between {1 / REACH:g} and {REACH:g} can be undone")


ROUGHNESS: Final = 0.3  # of what reflects, where it is not written
MAX_OBJECTS = 100_000
MAX_DEPTH = 1_000  # nested nodes of a Scene. Text cannot come near it; a Scene built in Python can

Spans = SpanMap
Leaves = dict[int, tuple[schema.Object, schema.Material | None, Leaf]]
"""Objects, by identity, with the material around them and their leaves."""


class Memory:
    """The leaves of the last frame of an animation: objects that stay keep theirs, with their notes."""

    def __init__(self) -> None:
        self.leaves: Leaves = {}
        self.model = ""  # that they were lowered for


def lower(
    scene: Scene,
    manifest: Manifest,
    spans: Spans | None,
    diagnostics: Diagnostics,
    memory: Memory | None = None,
) -> Graph:
    """The graph of a scene for one model, without what the model does not have, which is reported."""
    _check_canvas(scene, manifest, spans.span(scene) if spans else None, diagnostics)
    for word in words.STAGE if manifest.dimension == 2 else ():
        if (stated := getattr(scene, word)) != "default":
            first = stated[0] if isinstance(stated, tuple) else stated
            place = None if spans is None else spans.span(first) or spans.span(scene)
            fact = f"model `{manifest.name}` is flat and has no {word}"
            diagnostics.add("E0511", fact, place, help="leave it out; flat scenes have none")
    space = SPACES[manifest.dimension]
    old: Leaves = {} if memory is None or memory.model != manifest.name else memory.leaves
    brought = Brought.of(scene.elements)
    created: Leaves | None = None if memory is None else {}
    lit = scene.sky != "default"
    lowering = _Lowering(manifest, space, spans, diagnostics, old, created, brought, lit)
    root = lowering.run(scene)
    if memory is not None and lowering.created is not None:
        memory.leaves, memory.model = lowering.created, manifest.name
    stage = stage_of(scene) if space.dimension == 3 else None
    background = graph.WHITE if scene.background == "default" else scene.background
    elements = brought.geometries | lowering.drawn
    return Graph(root, scene.canvas, background, space, stage, elements, scene.samples)


def _check_canvas(scene: Scene, manifest: Manifest, place: Span | None, diagnostics: Diagnostics) -> None:
    width, height = scene.canvas
    most, model = manifest.limits.get("canvas", 8192), f"model `{manifest.name}`"
    if max(width, height) > most:
        fact = f"a canvas of {width} x {height} pixels; {model} draws at most {most} x {most}"
        diagnostics.add("E0507", fact, place, help="render smaller with `canvas(w, h)` or `--size`")
    elif manifest.sizes and scene.canvas not in manifest.sizes:
        sizes = " or ".join(f"{w} x {h}" for w, h in manifest.sizes)
        fact = f"a canvas of {width} x {height} pixels; {model} draws only {sizes}"
        help = "give that size with `canvas(w, h)` or `--size`, or draw with another model"
        diagnostics.add("E0509", fact, place, help=help)
    if manifest.white and scene.background not in (graph.WHITE, "default"):
        help = "leave `background` out, or draw with another model"
        diagnostics.add("E0510", f"{model} draws only over white", place, help=help)
    if scene.samples != 4 and not manifest.framed:
        help = "leave `samples` out, or draw with another model"
        diagnostics.add("E0381", f"{model} takes four samples of a pixel and no others", place, help=help)


_BY_POINTS: Final = drawn_element("polygon", ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))[0]


def _shrunk(step: Step, radius: float) -> Step:
    """The same skin of a leaf that was made so many times smaller."""
    return steps.Shell(step.w / radius) if isinstance(step, Shell) else steps.Grow(step.r / radius)  # type: ignore[union-attr]


Composite = Scene | schema.Group | schema.Boolean | schema.Chain


class _OpenComposite(Record, frozen=False):
    """A composite whose children are being lowered, and the operator that joins it to what came before."""

    op: Combine
    k: float
    node: Composite
    material: schema.Material | None
    todo: Iterator[tuple[Combine, float, schema.SceneNode]]
    links: list[Link] = field(default_factory=list)


def _children(node: Composite) -> Iterator[tuple[Combine, float, schema.SceneNode]]:
    if isinstance(node, schema.Chain):
        return ((link.op, _width(link), link.node) for link in node.children)
    op: Combine = "union"
    k = 0.0
    if isinstance(node, schema.Boolean):
        op, k = node.op, _width(node)
    return ((op, k, child) for child in (node.nodes if isinstance(node, Scene) else node.children))


def _width(node: schema.Boolean | schema.Link) -> float:
    """The width of a blend where it is not the usual one, else 0."""
    return 0.0 if node.k is None or (node.op == "smooth" and node.k == words.BLEND) else node.k


class _Lowering(Record, frozen=False):
    manifest: Manifest
    space: Space
    spans: Spans | None
    diagnostics: Diagnostics
    old: Leaves  # of the previous frame
    created: Leaves | None  # leaves of this frame; None without a memory
    brought: Brought
    lit: bool  # by a sky
    objects: int = 0
    origin: object = None  # decides between flat and solid: a scene with a model, else the first object
    looks: dict[int, Look] = field(default_factory=dict)
    said: set[tuple[str, str]] = field(default_factory=set)
    steps: dict[int, Step | Refusal] = field(default_factory=dict)
    drawn: dict[str, Element] = field(default_factory=dict)  # of polygons and splines

    def run(self, scene: Scene) -> Fold:
        stack = [_OpenComposite("union", 0.0, scene, None, _children(scene))]
        self.origin = scene if scene.model else None
        while True:
            here = stack[-1]
            if (item := next(here.todo, None)) is None:
                stack.pop()
                if isinstance(here.node, Scene):
                    return Fold("scene", tuple(here.links))
                kind = here.node.op if isinstance(here.node, schema.Boolean) else here.node.kind
                fold = Fold(kind, tuple(here.links), self.moves(here.node), self.place(here.node))
                stack[-1].links.append(Link(here.op, fold, here.k))
                continue
            op, k, node = item
            if not here.links:
                op, k = "union", 0.0
            elif k and op == "smooth" and not self.manifest.any_blend:
                fact = f"model `{self.manifest.name}` blends over {words.BLEND} and no other width"
                joined = here.node if isinstance(here.node, schema.Boolean) else node
                self.say("E0512", fact, joined, "leave k out, or draw with another model")
            material = node.material or here.material
            if isinstance(node, schema.Object):
                here.links.append(Link(op, self.leaf(node, material), k))
                self.objects += 1
                if self.objects > MAX_OBJECTS:
                    self.say("E0320", f"more than {MAX_OBJECTS:,} objects in one scene", node)
                    return Fold("scene", ())
            elif len(stack) > MAX_DEPTH:
                fact = f"nodes nested deeper than {MAX_DEPTH:,}"
                self.say("E0405", fact, node, "a group of a single child can be dropped")
                return Fold("scene", ())
            else:
                stack.append(_OpenComposite(op, k, node, material, _children(node)))

    def leaf(self, node: schema.Object, material: schema.Material | None) -> Leaf:
        self.origin = self.origin or node
        seen = self.old.get(id(node))
        number = self.objects + 1
        if seen and seen[0] is node and seen[1] is material and seen[2].number == number:
            leaf = seen[2]
            if node.points and leaf.geometry != node.geometry:
                self.drawn[leaf.geometry] = drawn_element(node.geometry, node.points)[0]
        else:
            if "." in node.geometry:
                self.element(node.geometry, self.brought.geometries, node, "E0501")
            elif node.geometry in words.OUTLINES and self.space.dimension == 2:
                self.drawable(node.geometry, _BY_POINTS, node, "E0501")
            elif node.geometry not in self.manifest.geometries:
                self.refuse("E0501", "geometry", node.geometry, self.manifest.geometries, node)
                if words.dimension_of(node.geometry) not in (None, self.space.dimension):
                    material = None  # which is of the other kind of scene, too
            look = Look(self.manifest.materials[0]) if material is None else self.look(material)
            notes: dict[Any, Any] | None = None if self.created is None else {}
            leaf = Leaf(node.geometry, look, self.moves(node), self.place(node), number, notes)
            leaf = self.by_points(node, leaf) if node.points and self.space.dimension == 2 else leaf
        if self.created is not None:
            self.created[id(node)] = node, material, leaf
        return leaf

    def element(self, name: str, known: Mapping[str, Element], node: object, code: str) -> Element | None:
        """The element of a name in a file; reports one that the model does not draw, or that is not there."""
        if (element := known.get(name)) is not None:
            self.drawable(name, element, node, code)
        elif name.partition(".")[0] in self.brought.unread:
            self.say("E0214", f"the file of `{name}` has not been read", node, "load the scene with a root")
        else:
            what = "material" if known is self.brought.materials else "geometry"
            fact = f"no file of elements has a {what} `{name}`"
            self.say(code, fact, node, "list its file in `elements`")
        return element

    def drawable(self, name: str, element: Element, node: object, code: str) -> None:
        """Report an element that the model does not draw."""
        if element.kind not in self.manifest.elements:
            kind = f"an {element.kind}" if element.kind.startswith("e") else f"a {element.kind}"
            help = "a scene is flat or solid; letters and drawings are of flat ones, meshes of solid ones"
            if element.dimension == self.space.dimension:
                help = "without a `model` line the usual model draws it"
            self.say(code, f"model `{self.manifest.name}` does not draw `{name}`, {kind}", node, help)

    def by_points(self, node: schema.Object, leaf: Leaf) -> Leaf:
        """The leaf of a polygon or a spline, an element in the unit disc that is moved to where it lies."""
        element, (x, y), radius = drawn_element(node.geometry, node.points)
        there = compose(steps.translation(x, y), scaling(radius, radius))
        own = [move for move in leaf.moves if isinstance(move.step, Own)]
        sized = [Move(_shrunk(move.step, radius), move.span) for move in own]
        skin = steps.Skin.of([move.step for move in sized])
        reach = abs(skin.grow) + skin.shell
        if not self.space.usable(there) or not reach < REACH:
            fact = f"`{node.geometry}` reaches {radius:.3g} around ({x:.3g}, {y:.3g})"
            fact = f"{fact} and grows by {reach * radius:.3g}" if reach >= REACH else fact
            self.say("E0312", f"{fact}, more than float32 holds", node, "give usual numbers, and scale it")
            return leaf
        self.drawn[element.name] = element
        moves = (*sized, Move(Affine(there), leaf.span), *leaf.moves[len(own) :])
        look = leaf.look
        if look.element is not None:
            look = replace(look, texture=(*look.texture, Affine(inverted(there))))
        return Leaf(element.name, look, moves, leaf.span, leaf.number, leaf.notes)

    def moves(self, node: schema.SceneNode) -> tuple[Move, ...]:
        result, own, first = [], set[str](), isinstance(node, schema.Object)
        for transform in node.transforms:
            if (kind := transform.kind) not in words.OWN_TRANSFORMS:
                first = False
            else:
                if not first or kind in own:
                    fact = f"`{kind}` does not stand first in the block of an object"
                    fact = f"a second `{kind}` of an object" if first else fact
                    help = "it changes the leaf's own distance, before any transform"
                    self.say("E0407", fact, transform, help)
                    continue
                own.add(kind)
            step = self.steps.get(id(transform))  # the Scene holds it, so that its id stays its own
            if step is None:
                step = self.steps[id(transform)] = step_of(transform, self.space)
                if idle := self.space.idle(transform):
                    help = "a 2D model has no z: leave the third factor out"
                    self.say("W0508", f"{idle} has no effect in the plane", transform, help)
            if isinstance(step, Refusal):
                place = self.place(transform)
                if place is not None and "." in place.text:  # where a shape of the library is called
                    self.say(step.code, misfit(place.text, step.message), transform)
                else:
                    self.say(step.code, step.message, transform, step.help)
            else:
                result.append(Move(step, self.place(transform)))
        return tuple(result)

    def look(self, material: schema.Material) -> Look:
        if (known := self.looks.get(id(material))) is not None:
            return known
        name, manifest = material.name, self.manifest
        element: Element | Gradient | None = None
        shading = material.shading or manifest.materials[0]
        if "." in name:
            element = self.element(name, self.brought.materials, material, "E0502")
        elif name in words.TEXTURES:
            element = self.element(name, load_textures(), material, "E0502")
        elif name in words.GRADIENTS:
            element = self.gradient(material)
        else:
            shading = name
            if material.shading is not None:
                self.say("E0502", f"`{name}` is not a texture", material, f"leave `{material.shading}` out")
        if shading not in manifest.shadings:
            offered = (*manifest.shadings, *words.PAINTS) if shading is name else manifest.shadings
            self.refuse("E0502", "material", shading, offered, material)
        moves = tuple(self.texture_moves(material, element))
        colours = graph.colour_steps(map(self.space.inked, material.ops))
        if len(graph.normal(colours)) > MOST_STEPS and element is not None:
            self.say("E0320", f"more than {MOST_STEPS:,} operations on the colours of `{name}`", material)
        own = self.properties(material, shading)
        kind = "diffuse" if shading in words.REFLECTING else shading
        look = self.looks[id(material)] = Look(kind, colours, graph.WHITE, element, moves, *own)
        return look

    def properties(
        self, material: schema.Material, shading: str
    ) -> tuple[float, float, float, tuple[float, float, float]]:
        """Opacity, density, roughness and glow, as looks have them; reports those that do not fit."""
        manifest, solid = self.manifest, self.space.dimension == 3
        for name in words.PROPERTIES:
            if getattr(material, name) == schema.LATER[name]:
                continue
            if not (manifest.framed and not solid if name == "opacity" else manifest.lights):
                help = "leave it out, or draw with another model"
                if name == "opacity" and solid:
                    help = "in space mist is translucent: material volumetric, with a density"
                self.say("E0380", f"model `{manifest.name}` has no `{name}`", material, help)
            elif shading not in words.KINDS_WITH.get(name, (shading,)):
                kinds = " and ".join(f"`{kind}`" for kind in words.KINDS_WITH[name])
                self.say("E0393", f"a `{name}` of `{shading}`", material, f"it is of {kinds}")
        roughness = 0.0
        if shading in words.REFLECTING and manifest.lights:
            if not self.lit:
                self.dark(material, shading)
            roughness = ROUGHNESS if material.roughness is None else material.roughness
        glow, power = BLACK, 0.0
        if material.glow is not None:
            glow, power = decoded(material.glow.color), material.glow.power
        r, g, b = (power * channel for channel in glow)
        signed = -roughness if shading == "metal" else roughness
        return material.opacity, material.density or 0.0, signed, (r, g, b)

    def dark(self, material: schema.Material, shading: str) -> None:
        """Report what reflects where no sky is, once; the fix adds one at the end of the scene's text."""
        if ("E0392", "") in self.said:
            return
        self.said.add(("E0392", ""))
        fix, main = None, None if self.spans is None else self.spans.main
        if main is not None and not re.search(r"\bmodule\s+sky\b", main.text):
            end = len(main.text)
            line = "sky();\n" if main.text.endswith("\n") else "\nsky();\n"
            fix = Fix("add `sky();`", (Edit(Span(main, end, end), line),))
        fact, help = f"`{shading}` reflects light from everywhere, and there is no sky", "write sky();"
        self.diagnostics.add("E0392", fact, self.place(material), help=help, fix=fix)

    def gradient(self, material: schema.Material) -> Gradient | None:
        """The gradient of a material, with colours in the space that they are averaged in."""
        if Gradient.kind not in self.manifest.elements:
            fact = f"model `{self.manifest.name}` does not draw `{material.name}`, a gradient"
            self.say("E0502", fact, material)
            return None
        inked = [op for op in map(self.space.inked, material.ops) if isinstance(op, schema.Stop)]
        return Gradient(material.name, tuple([(op.offset, *coloured((("color", *op.rgb),))) for op in inked]))

    def texture_moves(
        self, material: schema.Material, element: Element | Gradient | None
    ) -> Iterator[Affine]:
        """The moves of a texture; a constant material's are checked too, colours of space have none."""
        rows, space = IDENTITY, PLANE if self.space.dimension == 2 else SHEET
        for op in material.ops:
            if isinstance(op, schema.Color | schema.Grayscale | schema.Hue | schema.Stop):
                continue
            if element is not None and element.dimension == 3:
                fact = f"`{op.kind}` moves a texture, and `{material.name}` is a {element.kind}"
                self.say("E0504", fact, op, "its colours lie on the shape: leave the move out")
            elif isinstance(step := step_of(op, space), Refusal):
                if step.code == "E0312" or element is not None:
                    self.say(step.code, step.message, op, step.help)
            elif isinstance(step, Affine):
                rows = compose(step.rows, rows)
                yield step
        if not space.usable(rows):
            fact = f"the moves of the texture `{material.name}` compose to a singular one"
            self.say("E0406", fact, material, "scale less along one direction, or less often")

    def refuse(self, code: str, what: str, name: str, known: Sequence[str], node: object) -> None:
        """Report a geometry or material that the model does not have, or that is of the other dimension."""
        from difflib import get_close_matches

        here, other = self.space.dimension, words.dimension_of(name)
        listed = listing(f"`{k}`" for k in known)
        if other not in (None, here):
            fact = f"{what} `{name}` belongs to {SCENES[other]} scenes, and this one is {SCENES[here]}"
            help = f"a scene is flat or solid; model `{self.manifest.name}` has {listed}"
            if what == "material":
                help = f"write material {' or '.join(self.manifest.shadings)} in its place"
            if name in words.OUTLINES:
                help = f"`{name}` is a leaf of the plane; {help}"
            place = self.place(self.origin)
            labels = () if place in (None, self.place(node)) else (Label(place, f"{SCENES[here]} by this"),)
            self.say(code, fact, node, help, labels)
            return
        near = get_close_matches(name, known, 1)
        advice = f"did you mean `{near[0]}`? it has {listed}" if near else f"it has {listed}"
        self.say(code, f"model `{self.manifest.name}` has no {what} `{name}`", node, advice)

    def say(
        self, code: str, message: str, node: object, help: str | None = None, labels: tuple[Label, ...] = ()
    ) -> None:
        """Add a diagnostic; without a place each message is said once."""
        if (span := self.place(node)) is None:
            if (code, message) in self.said:
                return
            self.said.add((code, message))
        self.diagnostics.add(code, message, span, help=help, labels=labels)

    def place(self, node: object) -> Span | None:
        return None if self.spans is None else self.spans.span(node)
