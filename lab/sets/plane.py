"""Seeded random scenes to evaluate on, as Scenes: they go through the whole compiler.

``shapes2d`` is the base set: 1 to 4 objects, twirl and bend in ±0.8, scale 0.2 to 0.55 per axis, any
rotation, translation in ±0.7, in that order, colours uniform in 0.1 to 1, 40 % unions only, else tokens
uniform. The others change one thing each: `leaves2d` has discs and hexagons, `trees2d` any trees of all
leaves, with skins. `textures2d` has 1 to 4 squares with one of the textures each: scale and translation, and
of the texture flip, rotation and hue; `textures2d-mixed` has the four shapes, warps and booleans, and any
moves and colours of textures, one object in five being plain; `gradients` is that of gradients and all
leaves. `letters` has 1 to 3 words.
"""

from __future__ import annotations

import json
import math
import string
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenelang.language.evaluation import loads
from scenelang.language.scene import (
    Bend,
    Boolean,
    Chain,
    Color,
    Flip,
    Grayscale,
    Group,
    Grow,
    Hue,
    Link,
    Material,
    MaterialOp,
    Object,
    Rotate,
    Scale,
    Scene,
    SceneNode,
    Shear,
    Shell,
    Stop,
    Transform,
    Translate,
    Twirl,
)
from scenelang.language.words import COMBINE, LEAVES, TEXTURES, Combine

GEOMETRIES = ("square", "triangle", "star", "pentagon")
Rng = np.random.Generator


@dataclass(frozen=True, slots=True)
class SetConfig:
    """Distribution of the scenes of a set."""

    objects: tuple[int, int] = (1, 4)  # fewest and most objects
    deformed: bool = True  # with twirl and bend
    unions: float = 0.4  # share of scenes that are unions only
    size: float = 1.0  # factor on scales and translations of the objects
    warp: float = 0.8  # largest twirl and bend
    canvas: tuple[int, int] = (256, 256)  # pixels
    # random scales, rotations, translations and shears instead of one each; 0 for one each
    affine_steps: int = 0
    shuffled: bool = False  # scale, rotate, translate and shear once each, in random order
    geometries: tuple[str, ...] = GEOMETRIES
    rotated: bool = True
    # of textures: "few" are flipped, rotated and their hue turned, "any" moved and coloured in any
    # order, as "gradients" are, "" has none
    textures: Literal["", "few", "any", "gradients"] = ""
    clear: bool = False  # whether most objects show what lies behind
    # how objects are put together: "chain", "groups" (each in two nested groups), "tree", which needs no
    # group of a stream, "any" tree, or the "leaves" of such a tree as a chain
    nest: str = "chain"
    skins: bool = False  # whether objects grow, or are shells, or both
    words: bool = False  # of the font that ships, in place of leaves


SETS: dict[str, SetConfig] = {
    "shapes2d": SetConfig(),
    "leaves2d": SetConfig(geometries=("disc", "hexagon")),
    "unions": SetConfig(unions=1.0),
    "affine": SetConfig(unions=1.0, deformed=False),
    "chains": SetConfig(unions=0.0, objects=(2, 4)),
    "groups": SetConfig(nest="groups"),
    "twelve": SetConfig(affine_steps=12),
    "shuffled": SetConfig(shuffled=True),
    "tiny": SetConfig(size=0.1),
    "wide": SetConfig(canvas=(320, 192)),
    "tree": SetConfig(nest="tree", objects=(3, 4)),
    "deep": SetConfig(nest="tree", objects=(5, 8)),
    "trees": SetConfig(nest="any"),
    "leaves": SetConfig(nest="leaves"),
    "many": SetConfig(objects=(16, 16)),
    "crowd": SetConfig(objects=(100, 100), size=0.4),
    "strong": SetConfig(warp=2.4),
    "large": SetConfig(size=3.0),
    "skins": SetConfig(skins=True, geometries=(*LEAVES[2],)),
    "trees2d": SetConfig(nest="any", skins=True, geometries=(*LEAVES[2],)),
    "gradients": SetConfig(textures="gradients", geometries=(*LEAVES[2],)),
    "opacity": SetConfig(clear=True, geometries=(*LEAVES[2],)),
    "letters": SetConfig(objects=(1, 3), words=True),
    "textures2d": SetConfig(
        unions=1.0, deformed=False, geometries=("square",), rotated=False, textures="few"
    ),
    "textures2d-mixed": SetConfig(textures="any"),
}


def _uniform(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _moves(rng: Rng, config: SetConfig) -> list[Transform]:
    moves: list[Transform] = []
    if config.deformed:
        moves += [
            Twirl(k=_uniform(rng, -config.warp, config.warp)),
            Bend(k=_uniform(rng, -config.warp, config.warp)),
        ]
    scale = Scale(x=_uniform(rng, 0.2, 0.55) * config.size, y=_uniform(rng, 0.2, 0.55) * config.size, z=1.0)
    rotate = Rotate(angle=_uniform(rng, -math.pi, math.pi))
    # tiny objects stand close together, so that they still meet
    reach = 0.7 * (config.size if config.size < 0.2 else 1.0)
    translate = Translate(x=_uniform(rng, -reach, reach), y=_uniform(rng, -reach, reach))
    if config.shuffled:
        some: list[Transform] = [scale, rotate, translate, Shear(axes="xy", k=_uniform(rng, -0.6, 0.6))]
        return moves + [some[i] for i in rng.permutation(4)]
    if not config.affine_steps:
        return [*moves, scale, *([rotate] if config.rotated else []), translate]
    return moves + long_chain(rng, config.affine_steps, scale, [rotate, translate])


def long_chain(rng: Rng, steps: int, first: Transform, last: list[Transform]) -> list[Transform]:
    """Random steps among the usual three, small enough that the object stays on the canvas."""
    chain: list[Transform] = [first]
    for _ in range(steps - 3):
        kind = int(rng.integers(4))
        if kind == 0:
            chain.append(Scale(x=_uniform(rng, 0.85, 1.18), y=_uniform(rng, 0.85, 1.18), z=1.0))
        elif kind == 1:
            chain.append(Rotate(angle=_uniform(rng, -math.pi, math.pi)))
        elif kind == 2:
            chain.append(Translate(x=_uniform(rng, -0.12, 0.12), y=_uniform(rng, -0.12, 0.12)))
        else:
            chain.append(Shear(axes="xy", k=_uniform(rng, -0.25, 0.25)))
    return [*chain, *last]


def _colour(rng: Rng) -> Color:
    return Color(rgb=(_uniform(rng, 0.1, 1.0), _uniform(rng, 0.1, 1.0), _uniform(rng, 0.1, 1.0)))


def random_gradient(rng: Rng) -> tuple[str, list[MaterialOp]]:
    """The kind of a gradient and its 2 to 8 stops; of a quarter two share their place."""
    places = sorted(rng.uniform(0.0, 1.0, int(rng.integers(2, 9))).tolist())
    if rng.random() < 0.25:
        places[-1] = places[-2]
    return ("linear", "radial")[int(rng.integers(2))], [Stop(at, _colour(rng).rgb) for at in places]


def _texture(rng: Rng, config: SetConfig) -> Material:
    """One of the textures or a gradient, moved and coloured."""
    if config.textures == "gradients":
        name, stops = random_gradient(rng)
    else:
        name, stops = TEXTURES[int(rng.integers(len(TEXTURES)))], []
    turn, hue = (_uniform(rng, -math.pi, math.pi) for _ in range(2))
    flips: list[MaterialOp] = [Flip()] if rng.random() < 0.5 else []
    if config.textures == "few":
        return Material(name, (*flips, Rotate(angle=turn), Hue(angle=hue)))
    some: list[MaterialOp] = [
        *flips,
        Rotate(angle=turn),
        Scale(x=_uniform(rng, 0.5, 2.0), y=_uniform(rng, 0.5, 2.0), z=1.0),
        Shear(axes="xy", k=_uniform(rng, -0.6, 0.6)),
        Translate(x=_uniform(rng, -1.0, 1.0), y=_uniform(rng, -1.0, 1.0)),
        Hue(angle=hue),
        Grayscale(amount=_uniform(rng, 0.0, 1.0)),
        _colour(rng),
    ]
    chosen = [some[i] for i in rng.permutation(len(some))[: int(rng.integers(len(some) + 1))]]
    return Material(name, (*stops, *chosen))


def random_skin(rng: Rng) -> list[Transform]:
    """Growth, a shell, or both in either order."""
    grow, shell = Grow(_uniform(rng, -0.2, 1.0)), Shell(_uniform(rng, 0.04, 0.8))
    kinds: tuple[list[Transform], ...] = [grow], [shell], [grow, shell], [shell, grow]
    return kinds[int(rng.integers(len(kinds)))]


def random_object(rng: Rng, config: SetConfig) -> Object:
    colour = _colour(rng)
    geometry = config.geometries[int(rng.integers(len(config.geometries)))]
    moves = (*(random_skin(rng) if config.skins else ()), *_moves(rng, config))
    if config.textures == "few" or (config.textures and rng.random() < 0.8):
        return Object(geometry, moves, _texture(rng, config))
    clear = config.clear and rng.random() < 0.7
    return Object(
        geometry, moves, Material("flat", (colour,), opacity=_uniform(rng, 0.1, 0.9) if clear else 1.0)
    )


def _words(rng: Rng, config: SetConfig) -> Scene:
    """Words of random letters of the font that ships, a third of them bent."""
    lines = ["nsg 1;", f"canvas{config.canvas};", 'import "std/letters" as abc;']
    letters = string.ascii_letters + string.digits + string.punctuation
    for _ in range(int(rng.integers(config.objects[0], config.objects[1] + 1))):
        word = "".join(letters[i] for i in rng.integers(len(letters), size=int(rng.integers(1, 9))))
        bend = f"bend({_uniform(rng, -0.5, 0.5)}); " if rng.random() < 1 / 3 else ""
        turn, x, y = _uniform(rng, -math.pi, math.pi), _uniform(rng, -0.5, 0.5), _uniform(rng, -0.5, 0.5)
        moves = (
            f"{bend}rotate({turn}rad); translate({x}, {y}); material flat {{ color({[*_colour(rng).rgb]}); }}"
        )
        size = _uniform(rng, 0.15, 0.8)
        lines.append(f'abc.text({json.dumps(word)}, size = {size}, align = "center") {{ {moves} }}')
    return loads("\n".join(lines))


def _tree(rng: Rng, leaves: list[SceneNode]) -> SceneNode:
    """A nested tree without groups of a stream: the first child may be composite, unions any."""
    if len(leaves) == 1:
        return leaves[0]
    cut = int(rng.integers(1, len(leaves)))
    if cut < len(leaves) - 1 and rng.random() < 0.5:
        # (…) - (b ∪ c) and (…) ∪ (c ∪ d) are rewritten
        op: Combine = "subtract" if rng.random() < 0.5 else "union"
        rest = Boolean(op="union", children=tuple(leaves[cut:]))
        return Boolean(op=op, children=(_tree(rng, leaves[:cut]), rest))
    word = COMBINE[int(rng.integers(4))]
    return Boolean(op=word, children=(_tree(rng, leaves[:-1]), leaves[-1]))


def any_tree(rng: Rng, leaf: Callable[[], SceneNode], depth: int = 4) -> Boolean:
    """A tree of up to a depth, of operators as likely as each other; a third of the cuts has a width."""
    word = COMBINE[int(rng.integers(4))]
    rounds = word in ("subtract", "intersect") and rng.random() < 1 / 3
    k = _uniform(rng, 0.05, 0.5) if rounds else None
    children = [
        leaf() if depth == 1 or rng.random() < 0.4 else any_tree(rng, leaf, depth - 1)
        for _ in range(int(rng.integers(2, 4)))
    ]
    return Boolean(word, children, k=k)


def chained(rng: Rng, node: SceneNode) -> Chain:
    """The leaves of a tree, joined one by one by operators as likely as each other."""
    leaves, stack = list[SceneNode](), [node]
    while stack:
        here = stack.pop()
        if isinstance(here, Boolean):
            stack.extend(reversed(here.children))
        else:
            leaves.append(here)
    words = ["union", *(COMBINE[int(rng.integers(4))] for _ in leaves[1:])]
    return Chain([Link(op=op, node=leaf) for op, leaf in zip(words, leaves, strict=True)])


def random_scene(rng: Rng, config: SetConfig) -> Scene:
    model = "shapes2d"
    if config.words:
        return _words(rng, config)
    if config.nest in ("any", "leaves"):
        tree = any_tree(rng, lambda: random_object(rng, config))
        node = tree if config.nest == "any" else chained(rng, tree)
        return Scene(model=model, canvas=config.canvas, nodes=(node,))
    count = int(rng.integers(config.objects[0], config.objects[1] + 1))
    objects = [random_object(rng, config) for _ in range(count)]
    if config.nest == "tree":
        return Scene(model=model, canvas=config.canvas, nodes=(_tree(rng, list(objects)),))
    unions = rng.random() < config.unions
    words = ["union", *(COMBINE[0 if unions else int(rng.integers(4))] for _ in range(count - 1))]
    nodes: list[SceneNode] = list(objects)
    turn = Rotate(angle=_uniform(rng, -math.pi, math.pi))
    if config.nest == "groups":
        shift = Translate(x=_uniform(rng, -0.1, 0.1), y=_uniform(rng, -0.1, 0.1))
        nodes = [
            Group(children=(Group(children=(n,), transforms=(shift,)),), transforms=(turn,)) for n in nodes
        ]
    links = tuple(Link(op=w, node=n) for w, n in zip(words, nodes, strict=True))
    chain = Chain(children=links)
    return Scene(model=model, canvas=config.canvas, nodes=(chain,))
