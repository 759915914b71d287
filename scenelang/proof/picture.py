"""Proofs of pictures: a compiled stream and proved errors of distances give a bound for every pixel."""

from __future__ import annotations

import numpy as np

from scenelang.graph.nodes import Graph
from scenelang.image import Image, from_samples
from scenelang.models.manifest import Manifest
from scenelang.outputs import PROVED, Proof
from scenelang.proof.errors import PROVER, Errors, load_errors
from scenelang.proof.fold import Enclosure, Floats
from scenelang.proof.regions import SIDES, Band
from scenelang.proof.stream import Stream

BAND = 1 << 17  # pixels at a time, at least a row of the largest regions
CROWD = 32  # objects in reach of a place, above which fewer pixels are asked at a time
ROUNDING = 2e-7  # of a channel: what is lost where pictures are kept in float32


class ProofError(Exception):
    """A picture of a kind of which nothing is proved."""


def prove_image(
    lowered: Graph, graph: Graph, manifest: Manifest, image: Image, *, redraw: bool = False
) -> tuple[Image, Proof]:
    """Prove by how much each pixel of a picture, whoever drew it, differs from the exact one at most.

    Args:
        lowered: the scene as written.
        graph: its stream of leaves.
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
    stream = Stream(lowered, graph, manifest, known_errors(manifest))
    (width, height), behind = graph.canvas, np.zeros(4)
    if graph.background is not None:
        behind = np.asarray(graph.background, np.float64)
    if image.shape != (height, width, len(behind)):
        raise ProofError(f"a picture of {image.shape}, where the scene has {(height, width, len(behind))}")
    picture = np.array(image, np.float64)
    if clear := graph.background is None:
        picture[..., :3] *= picture[..., 3:]
    bound, redrawn = np.empty((height, width), np.float32), 0
    rows = -(-max(1, int(BAND / width / (1 + stream.crowd(graph.canvas) / CROWD))) // SIDES[0]) * SIDES[0]
    for top in range(0, height, rows):
        part = range(top, min(top + rows, height))
        band, drawn = Band(stream, graph.canvas, part, behind), picture[part.start : part.stop]
        found = _off(drawn, band.shown)
        if redraw and (bad := found > PROVED).any():
            band.draw(bad & (_off(band.shown.low, band.shown) > PROVED))
            middle = (band.shown.low + band.shown.high) / 2
            bad &= _off(middle, band.shown) <= PROVED  # what stays open stays as it was drawn
            drawn[bad] = middle[bad]
            found = _off(drawn, band.shown)
            redrawn += int(bad.sum())
        bound[part.start : part.stop] = found
    if redrawn:
        credit = image.credit
        image = from_samples(picture[..., :3], picture[..., 3] if clear else None)
        image.credit = credit
    return image, Proof(bound, redrawn, stream.unknown)


def _off(drawn: Floats, shown: Enclosure) -> Floats:
    """How far pixels (H, W, K) may lie from what is shown, by their worst channels."""
    far = np.maximum(shown.high - drawn, drawn - shown.low)
    worst = far[..., 0]
    for channel in range(1, far.shape[-1]):
        worst = np.maximum(worst, far[..., channel])
    return worst + ROUNDING


def known_errors(manifest: Manifest) -> dict[str, Errors]:
    """What is proved of the distances of geometries; raises as `prove_image`."""
    if manifest.dimension != 2:
        raise ProofError("pictures of solids are not proved, those of the plane are")
    if manifest.lifting != "exact":
        raise ProofError(f"pictures of `{manifest.name}` are not proved, as it learned where points lie too")
    if not (known := load_errors()):
        raise ProofError(f"no proof comes with these weights of `{PROVER}`")
    return known
