"""Proofs of pictures: a compiled stream and proved errors of distances give a bound for every pixel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scenelang.graph.chain import split_levels
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.spaces import PLANE
from scenelang.image import Image, from_samples
from scenelang.lifting.exact import lift_many
from scenelang.lifting.layout import PLANE_LAYOUT as LAYOUT
from scenelang.models.manifest import Manifest
from scenelang.outputs import PROVED, Proof
from scenelang.proof.errors import PROVER, Errors, load_errors
from scenelang.proof.fold import NOTHING, UNION, Enclosure, Floats
from scenelang.proof.regions import Band, Objects
from scenelang.reference.field import carry_back, leaf_distance
from scenelang.reference.textures import colour_at
from scenelang.renderers.frames import Frames
from scenelang.renderers.meetings import Index
from scenelang.words import TOKENS

BAND = 1 << 17  # pixels at a time, at least a row of the largest regions
ROUNDING = 2e-7  # of a channel: what is lost where pictures are kept in float32
TAME = 1e-9  # leaf units: what float64 loses on the way to a leaf, times ten, where maps are not extreme
Way = Callable[[str, Floats], Enclosure]


class ProofError(Exception):
    """A picture of a kind of which nothing is proved."""


def prove_image(
    graph: Graph, manifest: Manifest, image: Image, *, redraw: bool = False
) -> tuple[Image, Proof]:
    """Prove by how much each pixel of a picture, whoever drew it, differs from the exact one at most.

    Args:
        graph: the stream that all passes have left.
        manifest: of the model that it was compiled for.
        image: (H, W, 3), or (H, W, 4) where the background is none.
        redraw: draw again what is not proved right to `PROVED`: by what is known of it, and where that is not
            enough by the exact distances.

    Returns:
        The picture and its proof.

    Raises:
        ProofError: the model is not of the plane, or learned more than distances; a file is missing.
        ModelError: a file is damaged.
    """
    objects = objects_of(graph, manifest)
    (width, height), behind = graph.canvas, np.zeros(4)
    if graph.background is not None:
        behind = np.asarray(graph.background, np.float64)
    if image.shape != (height, width, len(behind)):
        raise ProofError(f"a picture of {image.shape}, where the scene has {(height, width, len(behind))}")
    picture = np.array(image, np.float64)
    if clear := graph.background is None:
        picture[..., :3] *= picture[..., 3:]
    bound, redrawn = np.empty((height, width), np.float32), 0
    rows = -(-max(1, BAND // width) // 8) * 8
    for top in range(0, height, rows):
        part = range(top, min(top + rows, height))
        band, drawn = Band(objects, graph.canvas, part, behind), picture[part.start : part.stop]
        found = _off(drawn, band.shown)
        if redraw and (bad := found > PROVED).any():
            band.draw(bad & (_off(band.shown.low, band.shown) > PROVED))
            drawn[bad] = (band.shown.low[bad] + band.shown.high[bad]) / 2
            found = _off(drawn, band.shown)
            redrawn += int(bad.sum())
        bound[part.start : part.stop] = found + ROUNDING
    if redrawn:
        credit = image.credit
        image = from_samples(picture[..., :3], picture[..., 3] if clear else None)
        image.credit = credit
    return image, Proof(bound, redrawn)


def _off(drawn: Floats, shown: Enclosure) -> Floats:
    """How far pixels (H, W, K) may lie from what is shown, by their worst channels."""
    far = np.maximum(shown.high - drawn, drawn - shown.low)
    worst = far[..., 0]
    for channel in range(1, far.shape[-1]):
        worst = np.maximum(worst, far[..., channel])
    return worst


def known_errors(manifest: Manifest) -> dict[str, Errors]:
    """What is proved of the distances of geometries; raises as `prove_image`."""
    if manifest.dimension != 2:
        raise ProofError("pictures of solids are not proved, those of the plane are")
    if manifest.lifting != "exact":
        raise ProofError(f"pictures of `{manifest.name}` are not proved, as it learned where points lie too")
    if not (known := load_errors()):
        raise ProofError(f"no proof comes with these weights of `{PROVER}`")
    return known


def objects_of(graph: Graph, manifest: Manifest) -> Objects:
    """The objects of a stream; raises as `prove_image`."""
    known = known_errors(manifest)
    leaves: list[Leaf] = [leaf for _, leaf in graph.rows()]
    levels = [split_levels(leaf.steps, manifest.limits, PLANE) for leaf in leaves]
    frames = Frames(lift_many(levels, [(0.0,) * LAYOUT.code] * len(leaves), LAYOUT))
    names = [leaf.geometry for leaf in leaves]
    shapes = {name: np.array([own == name for own in names]) for name in dict.fromkeys(names)}
    largest = [abs(frames.numbers[slot]).max(0, initial=1.0) for slot in (LAYOUT.frame, LAYOUT.middle)]
    rounding = TAME * (1 + 1e-5 * frames.stretch * largest[0] * largest[1])

    def enclosed(answer: Way, which: Index, q: Floats) -> Enclosure:
        found = Enclosure(np.full(len(which), -NOTHING), np.full(len(which), NOTHING))
        finite = np.isfinite(q).all(0)
        for name, own in shapes.items():
            some = np.flatnonzero(own[which] & finite)
            if len(some):
                low, high = answer(name, q[:, some])
                found.low[some], found.high[some] = low - rounding[which[some]], high + rounding[which[some]]
        return found

    def learned(name: str, q: Floats) -> Enclosure:
        if name in graph.elements or name not in known:  # somewhere in the unit disc
            length = np.hypot(*q)
            return Enclosure(length - 1, length + 1)
        return known[name].exact(q)

    def exact(name: str, q: Floats) -> Enclosure:
        if name in graph.elements:
            return learned(name, q)
        d = leaf_distance(name, q)
        return Enclosure(d, d)

    plain = np.array([leaf.look.colour() for leaf in leaves]).reshape(-1, 3).T
    painted = np.array([leaf.look.element is not None for leaf in leaves], bool)

    def colour(which: Index, q: Floats, radius: Floats) -> Enclosure:
        low, high = plain[:, which], plain[:, which]
        for at in np.unique(which[painted[which]]).tolist():
            some, look = which == at, leaves[at].look
            low[:, some], high[:, some] = 0.0, 1.0
            some &= radius == 0
            if some.any():
                low[:, some] = high[:, some] = colour_at(look, carry_back(look.texture, q[:, some])).T
        return Enclosure(low, high)

    tokens = np.array([TOKENS[op] for op, _ in graph.rows()], np.intp)
    tokens[:1] = UNION
    return Objects(
        frames,
        tokens,
        np.array([link.k for link in graph.root.links]),
        colour,
        lambda which, q: enclosed(learned, which, q),
        lambda which, q: enclosed(exact, which, q),
    )
