"""Decoders of the plane's leaves with their leaf's symmetry, fitted by Gauss-Newton steps from many starts.

A regular leaf stays itself when it is turned or mirrored. So does a decoder whose hidden units come in
orbits, the turned and mirrored copies of one unit each, with equal weights between pairs that such a move
carries into each other. Less than a hundred of a thousand numbers are left then, and half a sector of points
determines them: few enough for damped Gauss-Newton steps (Levenberg 1944, Marquardt 1963) from a hundred
starts. Most of these end in a poor minimum, some in a very good one.

    python -m lab.symmetric FOLDER

writes weights of `shapes2d` with new decoders into a folder; everything else is taken over.

Letters: n order of the leaf, P points, T parameters, H1 and H2 hidden units, N numbers of a decoder.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from safetensors.numpy import save

from scenelang.assets.files import write_whole
from scenelang.compiler.geometries import sector_distance
from scenelang.compiler.weights import open_weights, shipped_weights
from scenelang.drawing.neural.network import RADIUS

Floats = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Rng = np.random.Generator

SOFT, POWER = 0.03, 0.6  # an error at distance d is divided by (|d| + SOFT) ** POWER
BEYOND = 1.2  # leaf units: from here on errors count half
FIRST, MORE = (60, 1200), (30, 3000)  # steps and points of every start; and of each round of the best
FRESH = 15  # steps between new points


class SymmetricLeaf(NamedTuple):
    """A shape of dihedral symmetry, with a vertex at +x, at radius 1."""

    order: int
    inner: float  # radius, half a sector on, of the vertex's edge; 0 for a disc

    def distance(self, p: Floats) -> Floats:
        """Exact distances (P,) at points (2, P)."""
        result: Floats = np.hypot(*p) - 1.0
        return result if not self.inner else sector_distance(p, self.order, 0.0, 1.0, self.inner)

    def points(self, count: int, rng: Rng) -> Floats:
        """Points (2, count) of the half sector: half of them near the outline at all scales."""
        half, near = math.pi / self.order, count // 2
        s = rng.uniform(0, 1, near)
        along = half * s
        outline = np.stack([np.cos(along), np.sin(along)])
        if self.inner:
            corner = self.inner * np.array([math.cos(half), math.sin(half)])
            outline = np.stack([1 + s * (corner[0] - 1), s * corner[1]])
        outline += rng.normal(size=outline.shape) * 10 ** rng.uniform(-3.5, -0.2, near)
        even = RADIUS * rng.uniform(0, 1, count - near) ** 0.6
        even[::3] = rng.uniform(0, 1, len(even[::3])) ** 0.5
        radius = np.append(np.hypot(*outline), even).clip(0, RADIUS)
        angle = np.append(np.arctan2(outline[1], outline[0]), rng.uniform(0, half, count - near))
        angle = abs((angle + half) % (2 * half) - half)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)])


LEAVES: Final = {
    "square": SymmetricLeaf(4, math.cos(math.pi / 4)),
    "triangle": SymmetricLeaf(3, math.cos(math.pi / 3)),
    "star": SymmetricLeaf(5, 0.381966),
    "pentagon": SymmetricLeaf(5, math.cos(math.pi / 5)),
    "disc": SymmetricLeaf(16, 0.0),
    "hexagon": SymmetricLeaf(6, math.cos(math.pi / 6)),
}


class SymmetricDecoder:
    """A decoder whose numbers are linear in few parameters.

    ``layers`` are orbits of both hidden layers, a letter each: ``g`` has 2n units, ``v`` and ``e`` have n,
    each its own mirror image at the axis of a vertex or of an edge, ``1`` is one unit of the second layer.
    ``parts`` are weights and biases, layer by layer, as matrices (numbers, parameters of the part).
    """

    def __init__(self, order: int, layers: tuple[str, str]) -> None:
        first, second = (_moves(order, kinds) for kinds in layers)  # (2n, H)
        pairs = second[:, :, None] * first.shape[1] + first[:, None]  # (2n, H2, H1)
        ways = _ways(order, layers[0])
        self.parts = [ways, _ties(first), _ties(pairs), _ties(second), _ties(second), np.ones((1, 1))]
        self._sizes = first.shape[1], second.shape[1]
        self._cuts = np.cumsum([part.shape[1] for part in self.parts])

    def start(self, rng: Rng) -> Floats:
        """Random parameters (T,)."""
        h1, h2 = self._sizes
        sizes = 0.9, 0.5, math.sqrt(2 / h1), 0.2, math.sqrt(2 / h2), 0.0
        sigma = np.repeat(sizes, [part.shape[1] for part in self.parts])
        return sigma * rng.normal(size=len(sigma))

    def numbers(self, parameters: Floats) -> list[Floats]:
        """Weights (H1, 2), biases (H1,), (H2, H1), (H2,), (1, H2), (1,)."""
        h1, h2 = self._sizes
        split = np.split(parameters, self._cuts[:-1])
        shapes: list[tuple[int, ...]] = [(h1, 2), (h1,), (h2, h1), (h2,), (1, h2), (1,)]
        return [(m @ own).reshape(shape) for m, own, shape in zip(self.parts, split, shapes, strict=True)]

    def distance(self, parameters: Floats, p: Floats) -> Floats:
        """Learned distances (P,) at points (2, P)."""
        w1, b1, w2, b2, w3, b3 = self.numbers(parameters)
        units = np.maximum(p.T @ w1.T + b1, 0.0)
        result: Floats = np.maximum(units @ w2.T + b2, 0.0) @ w3[0] + b3[0]
        return result

    def slopes(self, parameters: Floats, p: Floats) -> tuple[Floats, Floats]:
        """Learned distances (P,) at points (2, P), and their derivatives (P, T) by the parameters."""
        w1, b1, w2, b2, w3, b3 = self.numbers(parameters)
        one = np.maximum(p.T @ w1.T + b1, 0.0)
        two = np.maximum(one @ w2.T + b2, 0.0)
        by_two = (two > 0) * w3[0]  # (P, H2)
        by_one = (by_two @ w2) * (one > 0)  # (P, H1)
        by_w1, by_w2 = (a[:, :, None] * b[:, None] for a, b in ((by_one, p.T), (by_two, one)))
        count = p.shape[1]
        by = [by_w1.reshape(count, -1), by_one, by_w2.reshape(count, -1), by_two, two, np.ones((count, 1))]
        parts = [own @ matrix for own, matrix in zip(by, self.parts, strict=True)]
        return two @ w3[0] + b3[0], np.concatenate(parts, 1)


def _moves(n: int, kinds: str) -> Index:
    """Permutation of units (2n, H) by each of the 2n moves; the second n mirror before they turn."""
    move = np.arange(2 * n)[:, None]
    mirrored, orbits, first = move >= n, [], 0
    for kind in kinds:
        unit = np.arange({"g": 2 * n, "1": 1}.get(kind, n))
        to = (move + np.where(mirrored, -unit - (kind == "e"), unit)) % n
        if kind == "g":
            to += n * (mirrored ^ (unit >= n))
        orbits.append(to * (kind != "1") + first)
        first += len(unit)
    return np.concatenate(orbits, 1)


def _ways(n: int, kinds: str) -> Floats:
    """Weights of the first layer (2 H1, parameters): turned and mirrored copies of one vector an orbit."""
    angles = math.tau / n * np.arange(n)
    columns = []
    for at, kind in enumerate(kinds):
        if kind == "g":
            x, y = np.cos(angles), np.sin(angles)
            axes = [np.stack([[x, y], [x, y]]), np.stack([[-y, x], [y, -x]])]  # of (1, 0) and of (0, 1)
        else:
            turned = angles + (kind == "e") * math.pi / n
            axes = [np.stack([np.cos(turned), np.sin(turned)])[None]]
        columns += [(at, axis.swapaxes(1, 2).ravel()) for axis in axes]
    sizes = [next(len(own) for where, own in columns if where == at) for at in range(len(kinds))]
    result = np.zeros((sum(sizes), len(columns)))
    for column, (at, own) in enumerate(columns):
        first = sum(sizes[:at])
        result[first : first + len(own), column] = own
    return result


def _ties(moves: Index) -> Floats:
    """One parameter for all that moves (2n, …) carry into each other: (numbers, parameters)."""
    label = np.unique(moves.min(0).ravel(), return_inverse=True)[1]
    return np.eye(label.max() + 1)[label]


class Start:
    """One random start of a leaf's decoder, which goes on where it stopped."""

    def __init__(self, leaf: str, layers: tuple[str, str], seed: int) -> None:
        self.leaf = LEAVES[leaf]
        self.decoder = SymmetricDecoder(self.leaf.order, layers)
        self.rng = np.random.default_rng([seed, sum(map(ord, leaf + "".join(layers)))])
        self.parameters = self.decoder.start(self.rng)
        self.damping = 0.01

    def run(self, steps: int, count: int) -> float:
        """Take so many steps with so many points; returns the weighted mean squared error of the last."""
        for step in range(steps):
            if step % FRESH == 0:
                p = self.leaf.points(count, self.rng)
                exact = self.leaf.distance(p)
                weight = np.where(exact > BEYOND, 0.5, 1.0) * (abs(exact) + SOFT) ** -POWER
            result, by = self.decoder.slopes(self.parameters, p)
            wrong = (result - exact) * weight
            by *= weight[:, None]
            loss = float(wrong @ wrong)
            square, down = by.T @ by / count, by.T @ wrong / count
            for _ in range(8):
                damped = square + np.diag(self.damping * (np.diag(square) + 1e-9) + 1e-10)
                ahead = self.parameters - np.linalg.solve(damped, down)
                wrong = (self.decoder.distance(ahead, p) - exact) * weight
                if float(wrong @ wrong) < loss:
                    self.parameters, self.damping = ahead, max(self.damping / 2, 1e-7)
                    break
                self.damping = min(3 * self.damping, 1e3)
        return loss / count


class FitSettings(NamedTuple):
    """Settings of the fit of a leaf's decoder."""

    layers: tuple[str, str]  # orbits of the hidden layers
    seed: int  # of the best start that was found
    rounds: int  # of steps behind the first

    def run(self, leaf: str) -> list[Floats]:
        """The decoder's numbers, the leaf as scenes have it."""
        start = Start(leaf, self.layers, self.seed)
        start.run(*FIRST)
        for _ in range(self.rounds):
            start.run(*MORE)
        numbers = start.decoder.numbers(start.parameters)
        turn = math.pi / 4 if leaf == "square" else math.pi / 2
        cos, sin = math.cos(turn), math.sin(turn)
        return [numbers[0] @ np.array([[cos, sin], [-sin, cos]]), *numbers[1:]]


def placed(numbers: list[Floats], width: int) -> list[Floats]:
    """A decoder with so many units in each layer, of which those after its own are never above zero."""
    w1, b1, w2, b2, w3, b3 = numbers
    more, most = (0, width - len(b1)), (0, width - len(b2))
    result = [np.pad(w1, (more, (0, 0))), np.pad(b1, more, constant_values=-1.0), np.pad(w2, (most, more))]
    return [*result, np.pad(b2, most, constant_values=-1.0), np.pad(w3, ((0, 0), most)), b3]


def hiding(a: list[Floats], b: list[Floats], third: list[Floats], width: int) -> list[list[Floats]]:
    """Decoders a and b with so many units, for which 2 a - b is a third decoder.

    Codes of four numbers hold five leaves of any kind, and so one more on the line through two of them. The
    third's units, the last of each layer, are shut in a and b by their biases. The others have factors in the
    last layer that cancel: ±1 in a, ±2 in b.
    """
    w1, b1, w2, b2, w3, b3 = third
    # a unit that is 1 makes up for the last bias
    w2, b2, w3 = np.pad(w2, ((0, 1), (0, 0))), np.append(b2, 1.0), np.append(w3[0], b3 - (2 * a[5] - b[5]))
    shut = [2 * (RADIUS * np.hypot(*w1.T) + 1) + abs(b1), 2 + abs(b2)]
    ups, downs = (max(int((sign * own[4] > 0).sum()) for own in (a, b)) for sign in (1, -1))
    result = []
    for own, size in ((a, 1.0), (b, 2.0)):
        up = own[4][0] > 0
        at = np.where(up, up.cumsum() - 1, ups + (~up).cumsum() - 1)
        factor = abs(own[4][0]) / size
        parts = placed([*own[:2], np.zeros((0, len(own[1]))), np.zeros(0), np.zeros((1, 0)), own[5]], width)
        parts[2][at, : len(own[1])], parts[3][at] = own[2] * factor[:, None], own[3] * factor
        parts[4][0, :ups], parts[4][0, ups : ups + downs] = size, -size
        one, two = slice(-len(b1), None), slice(-len(b2), None)
        parts[0][one], parts[2][two, one], parts[4][0, two] = w1, w2, w3
        for part, place, bias, gap in ((parts[1], one, b1, shut[0]), (parts[3], two, b2, shut[1])):
            part[place] = (bias - gap) / 2 if own is a else -gap
        result.append(parts)
    return result


FITS: Final = {
    "square": FitSettings(("gge", "ge1"), 7, 60),
    "triangle": FitSettings(("ggg", "ggv"), 10, 60),
    "star": FitSettings(("ggg", "ge11"), 4, 100),
    "pentagon": FitSettings(("ggg", "ge1"), 12, 60),
    "disc": FitSettings(("ve", "e1"), 4, 60),
    "hexagon": FitSettings(("ve", "ve1"), 5, 30),
}
"""The starts whose ends ship."""
DISC: Final = (0.2, -0.1, 0.4, 0.0)
"""Its code: [code, 1] lies well beside those of the four before it."""


def trained(data: bytes) -> tuple[dict[str, npt.NDArray[np.float32]], dict[str, Any]]:
    """Tensors and header of `shapes2d` with new decoders; codes stay, so that vectors of Programs do."""
    header, arrays = open_weights(data)
    width = header["config"]["network"]["decoder_width"]
    result = {leaf: fit.run(leaf) for leaf, fit in FITS.items()}
    pair = hiding(result["square"], result["triangle"], result["hexagon"], width)
    goals = [*pair, *(placed(result[leaf], width) for leaf in ("star", "pentagon", "disc"))]
    codes = np.concatenate([arrays["codes"][:4].astype(np.float64), [DISC]])
    one = np.concatenate([codes, np.ones((len(codes), 1))], 1)
    for i in range(3):
        for kind, at in (("w", 2 * i), ("b", 2 * i + 1)):
            stacked = np.stack([goal[at].T for goal in goals])
            mixed = np.linalg.solve(one, stacked.reshape(len(one), -1))
            arrays[f"decoder_{kind}.{i}"] = mixed.reshape(stacked.shape).astype(np.float32)
    arrays["codes"] = np.concatenate([codes, [2 * codes[0] - codes[1]]]).astype(np.float32)
    fits = {leaf: fit._asdict() for leaf, fit in FITS.items()}
    header.pop("measured", None)  # of its own decoders
    return arrays, {**header, "decoders": {"fits": fits}}


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    tensors, about = trained(shipped_weights("shapes2d"))
    file = save(dict(sorted(tensors.items())), {"scenelang": json.dumps(about, sort_keys=True)})
    write_whole(folder / "weights.safetensors", file)
