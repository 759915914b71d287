"""Fits of norm units to leaves: Gauss-Newton steps on distances, from random starts until one is right.

    python -m lab.training.norms FOLDER

writes weights of `shapes2d` with new decoders; `solids.py` trains those of solids.

A leaf that has few numbers left is easy to fit exactly and easy to miss: of a hundred starts most end in a
poor minimum and some in one that is right to the last bit. So each leaf is given the features that its
symmetry leaves, as many lines as it takes, and starts until the error of one is below `RIGHT` (Levenberg
1944, Marquardt 1963).

Letters: P points, F features of the leaf, L its lines, T its parameters.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from itertools import count
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from safetensors.numpy import save

from scenelang.assets.files import write_whole
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import open_weights, shipped_weights
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural import units as plane
from scenelang.drawing.neural.network import FramedArrays, FramedConfig, parameter_shapes
from scenelang.drawing.solid.network import RADIUS
from scenelang.drawing.solid.norms import ACROSS, FEATURES, LEAST, LINES, MOST, UP
from scenelang.language.words import LEAVES

Floats = npt.NDArray[np.float64]

RIGHT = 1e-7  # leaf units: root mean square of errors
SEED = 2  # of the plane's starts and hidden units
SOFT, POWER = 0.05, 0.5  # an error at distance d is divided by (|d| + SOFT) ** POWER
FIRST, MORE = 60, 200  # steps of every start, and of those that come near
NEAR = 2e-3  # leaf units
POINTS, FRESH = 1000, 10  # of a step, and steps between new ones
SIDES = (0, 1, 2)
ROUND = (ACROSS, 1, UP)


class Sizes(NamedTuple):
    """Features of a leaf, lines of each of its units, lines inside, and those of a notch."""

    features: tuple[int, ...]
    units: tuple[int, ...]
    inner: int = 0
    notch: int = 0


SIZES: Final = {
    "sphere": Sizes((ACROSS, 1), (2,)),
    "torus": Sizes((ACROSS, 1), (3,)),
    "box": Sizes(SIDES, (3,), 3),
    "cylinder": Sizes((ACROSS, 1), (2,), 2),
    "cone": Sizes((ACROSS, UP), (3, 2), 2),
    "capsule": Sizes((ACROSS, 1), (2,)),
    "octahedron": Sizes((*SIDES, MOST, LEAST), (3,), 1),
    "square": Sizes(plane.GROUPS[1], (2,), 2),
    "triangle": Sizes(plane.GROUPS[3], (2,), 1),
    "star": Sizes(plane.GROUPS[4], (2,), 0, 2),
    "pentagon": Sizes(plane.GROUPS[4], (2,), 1),
    "disc": Sizes(plane.GROUPS[0], (1,), 1),
    "hexagon": Sizes(plane.GROUPS[5], (2,), 1),
}
"""The fewest that answer exactly, of those tried."""
DIMENSION: Final = {leaf: dimension for dimension in (2, 3) for leaf in LEAVES[dimension]}


def features_of(p: Floats, chosen: tuple[int, ...]) -> Floats:
    """Features (F + 1, P) of points (d, P), the last of them 1."""
    if len(p) == 2:
        return np.append(plane.features(NUMPY, p, chosen), np.ones((1, p.shape[1])), 0)
    x, y, z = p
    sides = abs(p)
    known = [*sides, np.hypot(x, z), y, sides.max(0), sides.min(0)]
    return np.stack([*(known[i] for i in chosen), np.ones_like(x)])


def points_of(count: int, rng: np.random.Generator, dimension: int) -> Floats:
    """Points (d, P): three in four in a ball of 1.3, the others in one of `RADIUS`."""
    p = rng.normal(size=(dimension, count))
    radius = np.where(np.arange(count) % 4 == 0, RADIUS, 1.3) * rng.uniform(0, 1, count) ** (1 / dimension)
    return np.asarray(p * (radius / np.linalg.norm(p, axis=0)))


class NormStart:
    """One random start: parameters (T,), the lines row by row and then the radius."""

    def __init__(self, leaf: str, seed: int) -> None:
        self.leaf, self.sizes = leaf, SIZES[leaf]
        self.rng = np.random.default_rng([seed, sum(map(ord, leaf))])
        self.columns = len(self.sizes.features) + 1
        lines = self.sizes.notch + sum(self.sizes.units) + self.sizes.inner
        rows = self.rng.normal(0.0, 0.7, (lines, self.columns))
        rows[:, -1] = self.rng.uniform(-1.0, 0.3, lines)
        self.parameters = np.append(rows, self.rng.uniform(0.0, 0.5))
        self.damping = 0.01

    def answer(self, parameters: Floats, f: Floats) -> tuple[Floats, Floats]:
        """Distances (P,) by features (F + 1, P), and their derivatives (L, P) by the lines' levels."""
        levels = parameters[:-1].reshape(-1, self.columns) @ f
        outer = self.sizes.notch + sum(self.sizes.units)
        above = np.maximum(levels[:outer], 0.0)
        notch, *parts = np.split(above, np.cumsum([self.sizes.notch, *self.sizes.units])[:-1])
        lengths = np.sqrt([(part * part).sum(0) for part in parts])
        best = lengths.argmax(0)
        result = lengths.max(0) - parameters[-1]
        rates = [
            part * ((best == i) / np.maximum(own, 1e-12))
            for i, (part, own) in enumerate(zip(parts, lengths, strict=True))
        ]
        if self.sizes.notch:
            taken = np.sqrt((notch * notch).sum(0))
            result = result - taken
            rates.insert(0, -notch / np.maximum(taken, 1e-12))
        if self.sizes.inner:
            inner = levels[outer:]
            depth = inner.max(0)
            result = result + np.minimum(depth, 0.0)
            rates.append((np.arange(len(inner))[:, None] == inner.argmax(0)) * (depth < 0.0))
        return result, np.concatenate(rates)

    def run(self, steps: int, many: int = POINTS) -> float:
        """Take so many steps; returns the root mean square of the errors at other points, leaf units."""
        exact = GEOMETRIES[self.leaf].distance
        for step in range(steps):
            if step % FRESH == 0:
                p = points_of(many, self.rng, DIMENSION[self.leaf])
                wanted, f = exact(p), features_of(p, self.sizes.features)
                weight = (abs(wanted) + SOFT) ** -POWER
            result, rates = self.answer(self.parameters, f)
            wrong = (result - wanted) * weight
            by = (rates[:, None] * (f * weight)).reshape(-1, many)
            by = np.concatenate([by, -weight[None]])
            loss, square, down = wrong @ wrong, by @ by.T / many, by @ wrong / many
            for _ in range(8):
                damped = square + np.diag(self.damping * (np.diag(square) + 1e-7) + 1e-10)
                ahead = self.parameters - np.linalg.solve(damped, down)
                wrong = (self.answer(ahead, f)[0] - wanted) * weight
                if wrong @ wrong < loss:
                    self.parameters, self.damping = ahead, max(self.damping / 2, 1e-8)
                    break
                self.damping = min(3 * self.damping, 1e4)
        p = points_of(4000, np.random.default_rng(0), DIMENSION[self.leaf])
        p[:, 0] = 0.0  # where few points lie near
        wrong = self.answer(self.parameters, features_of(p, self.sizes.features))[0] - exact(p)
        return float(np.sqrt((wrong * wrong).mean()))

    def placed(self, units: int) -> tuple[Floats, float]:
        """Lines of a network with so many units, (3 units + 3, FEATURES), and the radius; in the plane there
        are three more before these, of the notch.
        """
        rows, flat = self.parameters[:-1].reshape(-1, self.columns), DIMENSION[self.leaf] == 2
        sizes = [*([self.sizes.notch] if flat else []), *self.sizes.units]
        result = np.zeros((LINES * (units + 1 + flat), plane.FEATURES if flat else FEATURES))
        result[:, -1] = -1.0  # lines that are nowhere above zero
        if not self.sizes.inner:
            result[-LINES:, -1] = 1.0  # that say nothing
        places = [LINES * k + i for k, size in enumerate(sizes) for i in range(size)]
        places += [len(result) - LINES + i for i in range(self.sizes.inner)]
        for place, row in zip(places, rows, strict=True):
            result[place] = 0.0
            result[place, [*self.sizes.features, -1]] = row
        return result, float(self.parameters[-1])


def fitted(leaf: str, seed: int) -> tuple[NormStart, float]:
    """The first start of a leaf that comes out right, and its error."""
    for turn in count():
        start = NormStart(leaf, 1000 * seed + turn)
        error = start.run(FIRST)
        if error < NEAR:
            error = start.run(MORE)
        if error < RIGHT:
            return start, error
    raise AssertionError


def plane_weights(data: bytes) -> tuple[dict[str, npt.NDArray[np.float32]], dict[str, Any]]:
    """Tensors and header of weights of the plane with norm units in place of its decoders, the smallest that
    make them of its codes. These stay, so that vectors of Programs do, and so does all else.
    """
    header, arrays = open_weights(data)
    config = FramedConfig(units=1, hidden=8)
    codes, rng = arrays["codes"], np.random.default_rng(SEED)
    lift = {
        "lift_w": rng.normal(size=(config.code, config.hidden)).astype(np.float32),
        "lift_b": rng.uniform(size=config.hidden).astype(np.float32),
    }
    network = FramedArrays(config, lift)
    back = np.linalg.pinv(np.stack([network.lifted(code) for code in codes]).astype(np.float64))
    leaves = load_manifest("shapes2d").geometries
    ends = [fitted(leaf, SEED) for leaf in leaves]
    lines, radii = zip(*(start.placed(config.units) for start, _ in ends), strict=True)
    made = {"lines": np.tensordot(back, np.stack(lines), 1), "radius": back @ radii, **lift}
    names = parameter_shapes(config, *map(len, (codes, arrays["material_codes"])))
    errors = dict(zip(leaves, (error for _, error in ends), strict=True))
    told = {"config": {**header["config"], "network": asdict(config)}, "decoders": {"errors": errors}}
    return {name: {**arrays, **made}[name].astype(np.float32) for name in names}, {**header, **told}


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    tensors, about = plane_weights(shipped_weights("shapes2d"))
    file = save(dict(sorted(tensors.items())), {"scenelang": json.dumps(about, sort_keys=True)})
    write_whole(folder / "weights.safetensors", file)
