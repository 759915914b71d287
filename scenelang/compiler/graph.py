"""The Graph: leaves and folds with their moves and looks, conservative bounds, and invariants.

A constant material is white everywhere, so its look folds to one colour, in the space it was written in. The
operations of a texture are kept in order, as each clamps, and no matrix clamps or turns a hue.

A leaf is one object. A fold is a boolean node, a group or a chain, joined from the left: ``(first op second)
op third …``. Moves are nearest the leaf first. Everything is frozen; a pass builds a new graph. Walks may
go as deep as the graph, for which `check_scene` makes room.

A *level* asks for the box around all points whose world distance is below it, which a later `smooth` can
feel. World distance is the leaf's own distance times the smallest stretch of its affine maps, so a level
reaches ``level / stretch`` beyond the leaf in the leaf's own space: far, for a thin object.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from colorsys import hsv_to_rgb, rgb_to_hsv
from dataclasses import field
from enum import Enum
from math import inf, tau
from operator import attrgetter
from typing import Any, NamedTuple, TypeVar, cast

from scenelang.assets.element import Element, Gradient
from scenelang.assets.records import Record
from scenelang.compiler.spaces import Box, Space, Stage, flattened
from scenelang.compiler.steps import Affine, Rows, Step, composed
from scenelang.language.diagnostics import Span
from scenelang.language.scene import Color, Grayscale, Hue, MaterialOp
from scenelang.language.words import BLEND, REFLECTING, Combine

Triple = tuple[float, float, float]
WHITE: Triple = (1.0, 1.0, 1.0)
BLACK: Triple = (0.0, 0.0, 0.0)
LUMA: Triple = (0.2126, 0.7152, 0.0722)
MOST_STEPS = 1_000  # operations on the colours of a texture, in their normal form

ColourStep = tuple[str, *tuple[float, ...]]
"""``("color", r, g, b)``, ``("grayscale", amount)`` or ``("hue", turns)``."""


class Look(Record):
    """The material of an object: how it is lit, and the colour as written that operations start from.

    ``rgb`` in [0, 1] is white, or the result of a folded look; colours of a texture or a gradient
    (``element``) stand instead. ``colours`` and ``texture``, moves before x and y are taken, have what was
    written first first. ``opacity`` is the share, in [0, 1], that it hides of what lies behind. ``density``,
    ``roughness`` and ``glow`` are as in `Parts`; what reflects is ``diffuse`` with a roughness.
    """

    material: str
    colours: tuple[ColourStep, ...] = ()
    rgb: Triple = WHITE
    element: Element | Gradient | None = None
    texture: tuple[Affine, ...] = ()
    opacity: float = 1.0
    density: float = 0.0
    roughness: float = 0.0
    glow: Triple = BLACK

    def colour(self) -> Triple:
        """The colour of a constant material; of a texture, what white would become."""
        return coloured(self.colours, self.rgb)

    def folded(self) -> Look:
        """The same look in its normal form: of a constant material one colour."""
        if self.element is None:
            plain = (), self.colour(), None, ()
            return Look(self.material, *plain, *self.own) if self.texture or self.colours else self
        colours, moved = normal(self.colours), composed(self.texture)
        texture = (Affine(moved if moved[2] or moved[6] else flattened(moved)),) if self.texture else ()
        if (colours, texture) == (self.colours, self.texture):
            return self
        return Look(self.material, colours, self.rgb, self.element, texture, *self.own)

    @property
    def own(self) -> tuple[float, float, float, Triple]:
        """What operations on colours do not touch."""
        return self.opacity, self.density, self.roughness, self.glow

    @property
    def shading(self) -> str:
        """The word of its kind."""
        return self.material if not self.roughness else REFLECTING[self.roughness < 0.0]

    @property
    def matte(self) -> bool:
        """True where it sends out no light, and is of the usual density or reflects evenly."""
        return not self.density and not self.roughness and self.glow == BLACK

    @property
    def plain(self) -> bool:
        """True where an object hides all that lies behind it by one colour."""
        return self.element is None and self.opacity == 1.0

    @property
    def moved(self) -> Rows:
        return composed(self.texture)

    @property
    def tilted(self) -> bool:
        """True where z makes a difference to its texture."""
        return any(step.rows[2] or step.rows[6] for step in self.texture)


def colour_steps(ops: Iterable[MaterialOp]) -> tuple[ColourStep, ...]:
    """The operations on a colour among those of a material."""
    result: list[ColourStep] = []
    for op in ops:
        if isinstance(op, Color):
            result.append(("color", *op.rgb))
        elif isinstance(op, Grayscale):
            result.append(("grayscale", op.amount))
        elif isinstance(op, Hue):
            result.append(("hue", op.angle / tau))
    return tuple(result)


def normal(steps: Iterable[ColourStep]) -> tuple[ColourStep, ...]:
    """Join neighbouring operations of a kind where nothing is clamped between them, as in [0, 1]."""
    result: list[ColourStep] = []
    for step in steps:
        joined: ColourStep | None = step
        last = result[-1] if result else ("none",)
        if last[0] == step[0] and (step[0] == "hue" or all(0.0 <= n <= 1.0 for n in last[1:])):
            joined = _joined(result.pop(), step)
        elif step[0] == "hue":
            joined = _joined(("hue", 0.0), step)
        if joined is not None and joined not in _IDLE:
            result.append(joined)
    return tuple(result)


_IDLE: frozenset[ColourStep] = frozenset((("color", 1.0, 1.0, 1.0), ("grayscale", 0.0), ("hue", 0.0)))


def _joined(one: ColourStep, other: ColourStep) -> ColourStep:
    kind, *a = one
    _, *b = other
    if kind == "hue":
        return kind, (a[0] + b[0]) % 1.0
    if kind == "grayscale":
        return kind, a[0] + b[0] - a[0] * b[0]
    return kind, *[p * q for p, q in zip(a, b, strict=True)]


def coloured(steps: Iterable[ColourStep], rgb: Triple = WHITE) -> Triple:
    """The colour (r, g, b) in [0, 1] after all operations, clamped after each."""
    for kind, *numbers in steps:
        r, g, b = rgb
        if kind == "color":
            rgb = _clamped(r * numbers[0], g * numbers[1], b * numbers[2])
        elif kind == "grayscale":
            y = r * LUMA[0] + g * LUMA[1] + b * LUMA[2]
            rgb = _clamped(*(v + numbers[0] * (y - v) for v in rgb))
        else:
            h, s, v = rgb_to_hsv(r, g, b)
            rgb = _clamped(*hsv_to_rgb((h + numbers[0]) % 1.0, s, v))
    return rgb


def _clamped(r: float, g: float, b: float) -> Triple:
    return min(max(r, 0.0), 1.0), min(max(g, 0.0), 1.0), min(max(b, 0.0), 1.0)


MOST_OPEN = 15  # groups of a stream within each other: a token has four bits for how many end
BELOW = 1e-3  # world units below the ground that count as seen: more than a renderer's step behind a surface
T = TypeVar("T")


class Move(Record):
    """A step and where it was written; a step that merges several keeps the place of the first."""

    step: Step
    span: Span | None = None


class Leaf(Record):
    """One object: a leaf geometry, its look and its moves, nearest the leaf first; ``number`` is from 1.

    ``notes`` is a cache for a leaf that stays from frame to frame, else None. Neither is part of the value.
    """

    geometry: str
    look: Look
    moves: tuple[Move, ...] = ()
    span: Span | None = None
    number: int = 0
    notes: dict[Any, Any] | None = None

    _key = attrgetter("geometry", "look", "moves", "span")

    def changed(self, look: Look, moves: tuple[Move, ...]) -> Leaf:
        return Leaf(self.geometry, look, moves, self.span, self.number, None if self.notes is None else {})

    def noted(self, key: object, make: Callable[[Leaf], T]) -> T:
        """The result of ``make`` for this leaf, cached under ``key`` where the leaf takes notes."""
        if self.notes is None:
            return make(self)
        if key not in self.notes:
            self.notes[key] = make(self)
        return cast("T", self.notes[key])

    @property
    def called(self) -> str:
        """The word of its geometry: of what is drawn by points without the digest of these."""
        return self.geometry if "." in self.geometry else self.geometry.partition("_")[0]

    @property
    def steps(self) -> tuple[Step, ...]:
        return tuple([move.step for move in self.moves])


class Link(Record):
    """A child of a fold, joined to what came before, the first as a union; ``k`` as written, 0 for none."""

    op: Combine
    node: Node
    k: float = 0.0

    @property
    def width(self) -> float:
        """The width of the blend: of a `smooth` `BLEND` unless written; 0 for a sharp edge."""
        return self.k or (BLEND if self.op == "smooth" else 0.0)


class Fold(Record):
    """Children folded from the left, then moves in order; ``kind`` is ``scene``, or the word as written."""

    kind: str
    links: tuple[Link, ...]
    moves: tuple[Move, ...] = ()
    span: Span | None = None


Node = Leaf | Fold


class Row(NamedTuple):
    """A leaf of a stream, joined to what stands before it by ``op``, of width ``k`` as written or 0.

    The first leaf of a group ``begins`` it, and its op joins the group; ``ends`` counts the groups that end
    behind it. ``cuts`` says whether it, or a group around it, is cut out of something.
    """

    op: Combine
    leaf: Leaf
    k: float
    begins: bool
    ends: int
    cuts: bool


class Graph(Record):
    """A whole scene as a graph for one model; ``root`` is a fold of kind ``scene``.

    After `flatten` folds within it are groups of a stream. The background is in [0, 1] as written, or None.
    """

    root: Fold
    canvas: tuple[int, int]
    background: tuple[float, float, float] | None
    space: Space
    stage: Stage | None = None
    elements: dict[str, Element] = field(default_factory=dict)
    samples: int = 4  # of a pixel

    def rooted(self, root: Fold) -> Graph:
        return Graph(root, self.canvas, self.background, self.space, self.stage, self.elements, self.samples)

    def rows(self) -> list[Row]:
        """The leaves in order; folds among the links of folds are groups, whose first link is a leaf."""
        result: list[Row] = []

        def walk(fold: Fold, cut: bool, group: Link | None) -> None:
            for at, link in enumerate(fold.links):
                begun, cuts = group if at == 0 else None, cut or link.op == "subtract"
                if isinstance(link.node, Leaf):
                    joined = begun or link
                    result.append(Row(joined.op, link.node, joined.k, begun is not None, 0, cuts))
                else:
                    walk(link.node, cuts, link)
                    result[-1] = result[-1]._replace(ends=result[-1].ends + 1)

        walk(self.root, False, None)
        return result

    def window(self) -> Box:
        """The part of the world that decides the picture; below the ground nothing is seen or lit."""
        if (stage := self.stage) is not None:
            floor = -inf if stage.ground is None else stage.ground.y
            lowest = min([stage.camera.eye[1], *(at.position[1] - at.radius for at in stage.lights)])
            return (-inf, floor - BELOW if lowest > floor else -inf, inf, inf, -inf, inf)
        width, height = self.canvas
        side = min(width, height)
        return -width / side, -height / side, width / side, height / side, 0.0, 0.0


def bottom_up(root: Node, leaf: Callable[[Leaf], T], fold: Callable[[Fold, list[T]], T]) -> T:
    """The value of ``root``: a leaf is worth ``leaf(it)``, a fold ``fold(it, its children's values)``."""
    if isinstance(root, Leaf):
        return leaf(root)
    return fold(root, [bottom_up(link.node, leaf, fold) for link in root.links])


def nodes(root: Node) -> Iterator[Node]:
    """Every node, parents before children, in file order."""
    stack: list[Node] = [root]
    while stack:
        node = stack.pop()
        yield node
        if isinstance(node, Fold):
            stack.extend([link.node for link in reversed(node.links)])


def leaves(root: Node) -> Iterator[Leaf]:
    """Every leaf, in file order."""
    return (node for node in nodes(root) if isinstance(node, Leaf))


def links_within(fold: Fold) -> Iterator[Link]:
    """Every link of a fold and of those within it."""
    return (link for node in nodes(fold) if isinstance(node, Fold) for link in node.links)


def map_leaves(graph: Graph, change: Callable[[Leaf], Leaf], name: str) -> Graph:
    """The graph with ``change``, which depends on leaf and space alone, of each leaf, noted as ``name``."""

    def leaf(node: Leaf) -> Node:
        return change(node) if node.notes is None else node.noted(name, change)

    def fold(node: Fold, children: list[Node]) -> Fold:
        links = [Link(link.op, child, link.k) for link, child in zip(node.links, children, strict=True)]
        return Fold(node.kind, tuple(links), node.moves, node.span)

    return graph.rooted(fold(graph.root, [bottom_up(link.node, leaf, fold) for link in graph.root.links]))


def leaf_box(leaf: Leaf, level: float, space: Space) -> Box:
    """A box of all points of the world at a distance below ``level`` >= 0 of a leaf with all its moves."""
    return leaf.noted(level, lambda leaf: space.box(leaf.geometry, leaf.steps, level))


class Later(Record):
    """The blends behind a row that use its distance; they decide how far from its leaf the row matters.

    Two folds whose distances at a point are equal, or both at a level or above, are after a `smooth` equal,
    or both at that level less its width or above; a union, a cut and an intersection keep the level. What is
    cut out changes distances inside the picture, which blends see (``inside``). The ``total`` of the widths
    is a multiple of `BLEND`, the ``widest`` in world units; ``everywhere``: as far as its leaf.
    """

    total: float = 0.0
    widest: float = 0.0
    count: int = 0
    inside: bool = False
    everywhere: bool = False

    def of(self, op: Combine, width: float) -> Later:
        """Blends that see the operand of an operator, itself included.

        The operand of an intersection is seen by all that see what stands before it; one with a width sees
        how deep inside points are. A subtraction with a width also changes points that near to its operand.
        """
        everywhere = self.everywhere or (op == "subtract" and self.inside)
        if not width or op == "intersect":
            return Later(self.total, self.widest, self.count, self.inside or width > 0, everywhere)
        return self._wider(width, self.inside or op == "smooth", everywhere)

    def before(self, op: Combine, width: float) -> Later:
        """Blends that see all that an operator joins its operand to, itself included."""
        if not width:
            return self
        if op == "smooth":
            return self._wider(width, True, self.everywhere)
        return Later(self.total, self.widest, self.count, True, self.everywhere)

    def _wider(self, width: float, inside: bool, everywhere: bool) -> Later:
        total, widest = self.total + width / BLEND, max(self.widest, width)
        return Later(total, widest, self.count + 1, inside, everywhere)

    @property
    def level(self) -> float | None:
        """The level for `leaf_box` within which a row matters, None where it may anywhere."""
        return None if self.everywhere else BLEND * self.total


def overlap(a: Box, b: Box) -> bool:
    """True where two boxes share a point."""
    flat = a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]
    return flat and a[4] <= b[5] and b[4] <= a[5]


def meet(a: Box, b: Box) -> Box | None:
    """The box that two boxes share, None where they are apart."""
    if not overlap(a, b):
        return None
    near, far = max(a[4], b[4]), min(a[5], b[5])
    return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3]), near, far


class Invariant(Enum):
    """A property that a pass establishes and every later one keeps."""

    NO_IDENTITIES = "no move leaves every point where it is"
    COMPOSITE = "every fold below the root has at least two links"
    LOOKS = "the look of a constant material is one colour"
    MERGED = "no two affine maps are neighbours"
    AT_LEAVES = "no fold has moves"
    STREAM = "folds within folds are groups: none is a first link, and few lie within each other"


Checked = tuple[Space, bool, bool, bool]
"""The checks of a leaf: its space, and whether NO_IDENTITIES, MERGED and LOOKS must hold."""

Sound = dict[Checked, dict[int, Leaf]]  # leaves by identity, by what was checked of them


class InternalError(RuntimeError):
    """A bug of the compiler, not of the scene."""


def verify(graph: Graph, stage: str, holds: Collection[Invariant] = (), sound: Sound | None = None) -> Graph:
    """Check a graph after ``stage``, a pass or ``lower``; raises `InternalError`, else gives it back.

    ``holds`` is established by now; ``sound`` has leaves checked before and receives those of this graph.
    """
    fault = _fault(graph, frozenset(holds), {} if sound is None else sound)
    if fault is not None:
        raise InternalError(f"internal error after pass `{stage}`: it does not hold that {fault}")
    return graph


def _fault(graph: Graph, holds: frozenset[Invariant], sound: Sound) -> str | None:
    if graph.root.kind != "scene" or graph.root.moves:
        return "the root is a scene without moves"
    of_leaves = (i in holds for i in (Invariant.NO_IDENTITIES, Invariant.MERGED, Invariant.LOOKS))
    checked: Checked = (graph.space, *of_leaves)  # type: ignore[assignment]
    if checked not in sound:
        sound.clear()
    leaves = sound.setdefault(checked, {})
    folds = [(graph.root, 0)]
    while folds:
        fold, depth = folds.pop()
        if (fault := _fold_fault(fold, depth, holds) or _moves_fault(fold.moves, checked)) is not None:
            return fault
        for link in fold.links:
            node = link.node
            if isinstance(node, Fold):
                folds.append((node, depth + 1))
            elif leaves.get(id(node)) is not node:
                leaves[id(node)] = node
                if (fault := node.noted(checked, lambda leaf: _leaf_fault(leaf, checked))) is not None:
                    return fault
    return None


def _fold_fault(fold: Fold, depth: int, holds: frozenset[Invariant]) -> str | None:
    if fold.links and fold.links[0].op != "union":
        return "the first link of a fold is a union"
    if fold.moves and Invariant.AT_LEAVES in holds:
        return Invariant.AT_LEAVES.value
    begun = bool(fold.links) and isinstance(fold.links[0].node, Fold)
    if Invariant.STREAM in holds and (depth > MOST_OPEN or begun):
        return Invariant.STREAM.value
    if depth and Invariant.COMPOSITE in holds and len(fold.links) < 2:
        return Invariant.COMPOSITE.value
    return None


def _leaf_fault(leaf: Leaf, checked: Checked) -> str | None:
    r, g, b = leaf.look.rgb
    if not (0.0 <= r <= 1.0 and 0.0 <= g <= 1.0 and 0.0 <= b <= 1.0):
        return "colours lie in [0, 1]"
    if checked[3] and leaf.look.folded() is not leaf.look:
        return Invariant.LOOKS.value
    return _moves_fault(leaf.moves, checked)


def _moves_fault(moves: tuple[Move, ...], checked: Checked) -> str | None:
    space, tidy, merged, _ = checked
    after_map = False
    for move in moves:
        step = move.step
        if tidy and step.idle:
            return Invariant.NO_IDENTITIES.value
        if isinstance(step, Affine):
            if not space.holds(step.rows):
                return "a map stays within the space of its model"
            if merged and after_map:
                return Invariant.MERGED.value
            after_map = True
        else:
            after_map = False
    return None
