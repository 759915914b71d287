"""The stability suite: how a model's error grows as scenes leave what it was trained on.

PSNR alone misleads across canvas sizes and object counts, because most of a picture is flat and right: an
error is also given per edge pixel (of the exact picture) and per covered pixel, as the sum of absolute
errors, averaged over channels, over the number of such pixels.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lab import matrices
from lab.about import Report, about, revision, silent
from lab.probes import FLAT, TEXTURES, Kit, Probe, drifting, rng_of, union_of
from lab.sets.plane import SETS
from lab.sets.scenes import LEAST_COVER, coverage, sized, spread
from lab.sets.solids import SIDES
from lab.sets.solids import WARP as SOLID_WARP
from lab.solid_probes import SOLIDS
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.lifting import LAYOUTS, lift_geometry
from scenelang.compiler.lower import step_of
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.passes import OPTIONAL
from scenelang.compiler.program import Program
from scenelang.compiler.spaces import SPACES
from scenelang.compiler.steps import Affine, Step, Warp
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import flip, psnr
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.load import Framed, Model, Solids
from scenelang.drawing.torch_backend import draw_program
from scenelang.language.scene import Chain, Object, Scene
from scenelang.output.frontier import reference_of

EDGE = 2 / 255  # a pixel of an edge differs by more from a neighbour
FRAMES = 8
SIZES = {"canvas"}  # probes that only models of any size can take
IDEAL = 8  # samples along a pixel's side of a picture whose own sampling hardly shows

Array = npt.NDArray[np.float64]
Row = dict[str, Any]
"""Figures at a value of a probe."""


def kit_of(manifest: Manifest) -> Kit:
    """The sets and probes of a model."""
    return SOLIDS if manifest.dimension == 3 else TEXTURES if manifest.elements else FLAT


class PictureErrors(NamedTuple):
    """A picture against the exact one."""

    psnr: float  # dB, at most 50
    flip: float  # mean FLIP in [0, 1]
    per_edge: float  # absolute error per edge pixel
    per_covered: float  # absolute error per covered pixel
    square: float  # mean squared error, which no cap hides


def exact_picture(
    scene: Scene, model: Model, per_side: int = 2
) -> tuple[Array, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """The exact picture (H, W, 3), of the plane over white, which pixels are covered, which are on an edge.

    Solids also cover what they throw their shadow on.
    """
    solid = model.manifest.dimension == 3
    clear = scene.model_copy(update={"nodes": ()} if solid else {"background": None})
    result = np.asarray(reference_of(clear, model.manifest, per_side=per_side), np.float64)
    if solid:
        picture = np.asarray(reference_of(scene, model.manifest, per_side=per_side), np.float64)
        alpha = (np.abs(picture - result).max(2, keepdims=True) > EDGE).astype(np.float64)
    else:
        alpha = result[..., 3:]
        picture = result[..., :3] * alpha + (1 - alpha)
    edge = np.zeros(alpha.shape[:2], bool)
    for axis in (0, 1):
        step = np.abs(np.diff(np.concatenate([picture, alpha], 2), axis=axis)).max(2) > EDGE
        first, last = [(0, 0), (0, 0)], [(0, 0), (0, 0)]
        first[axis], last[axis] = (1, 0), (0, 1)
        edge |= np.pad(step, first) | np.pad(step, last)
    return picture, alpha[..., 0] > 0, edge


def compare(picture: Image, reference: tuple[Array, Any, Any]) -> PictureErrors:
    """Errors of a picture against what `exact_picture` gave."""
    exact_one, covered, edge = reference
    gap = np.asarray(picture, np.float64)[..., :3] - exact_one
    total = float(np.abs(gap).mean(2).sum())
    return PictureErrors(
        psnr(picture, exact_one),
        flip(picture, exact_one),
        total / max(1, edge.sum()),
        total / max(1, covered.sum()),
        float(np.square(gap).mean()),
    )


def unfolded(scene: Scene, program: Program, model: Model) -> Program:
    """The same Program of one chain, its vectors lifted one affine map after the other in float32."""
    (chain,) = scene.nodes
    assert isinstance(chain, Chain)
    vectors = program.vectors.copy()
    layout, space = LAYOUTS[model.manifest.dimension], SPACES[model.manifest.dimension]
    nodes = [link.node for link in chain.children if isinstance(link.node, Object)]
    steps = [[step_of(transform, space) for transform in node.transforms] for node in nodes]
    lifting = model.codes.lifting
    if lifting is not None:
        leaves = [model.manifest.geometries.index(node.geometry) for node in nodes]
        chains: list[list[Step]] = [[s for s in chain if isinstance(s, Affine | Warp)] for chain in steps]
        vectors[:, : lifting.codes.shape[1]] = lift_geometry(lifting, chains, leaves)
        return dataclasses.replace(program, vectors=vectors)
    for row, chain_steps in zip(vectors, steps, strict=True):
        g = matrices.leaf_vector(layout.unpack(row).code.tolist(), layout).astype(np.float32)
        for step in chain_steps:
            if isinstance(step, Affine):
                matrix = matrices.affine_matrix(step.rows, None, layout)
            else:
                matrix = matrices.warp_matrix(step, layout.places.inner, layout)  # type: ignore[arg-type]
            g = matrix.astype(np.float32) @ g
        row[: layout.geometry] = g[: layout.geometry]
    return dataclasses.replace(program, vectors=vectors)


def picture_of(model: Model, program: Program, **options: Any) -> Image:
    """A Program's picture; options are those of `renderers.draw.draw`, of solids those of `draw_program`."""
    if not isinstance(model.network, Framed):
        return draw_program(program, model, **{"threads": 1, "patient": True, **options}).image
    return draw(model.network, program, **options).image


def _drawn(model: Model, scene: Scene, folded: bool) -> Image:
    without = () if folded else OPTIONAL
    program = compile_scene(scene, model=model.manifest.name, codes=model.codes, without=without)
    return picture_of(model, program if folded else unfolded(scene, program, model))


def scene_of(probe: Probe, value: float, index: int, seed: int, model: Model) -> Scene:
    """The scene of a probe at a value; drawn again while it covers too little of the canvas."""
    scale = 1.0
    for attempt in range(200):
        scene = sized(probe.make(rng_of(seed, index, attempt), value), model.manifest)
        if coverage(scene, model.manifest) >= LEAST_COVER * scale:
            return scene
        scale *= 0.97  # thin and tiny objects never cover that much
    return scene


def run_probe(
    model: Model, name: str, scenes: int, seed: int, report: Report = silent, known: Sequence[Row] = ()
) -> dict[str, Any]:
    """Errors at every value of a probe, or rows ``known``; none where the model's canvas rules one out."""
    probe = kit_of(model.manifest).probes[name]
    rows: list[Row] = []
    before = {row["value"]: row for row in known}
    values = probe.values if name not in SIZES or not model.manifest.sizes else ()
    fine = name in SIZES and model.manifest.dimension == 2  # that of solids would take hours
    for at, value in enumerate(values):
        if value in before:
            rows.append(before[value])
            continue
        result, ideal, changes = [], [], []
        for index in range(scenes):
            scene = scene_of(probe, value, index, seed, model)
            picture = _drawn(model, scene, probe.folded)
            result.append(compare(picture, exact_picture(scene, model, IDEAL if probe.sampled else 2)))
            if probe.sampled:
                changes.append(_change(model, drifting(scene, FRAMES), IDEAL))
            if fine:
                ideal.append(compare(picture, exact_picture(scene, model, IDEAL)).per_edge)
        rows.append(
            {
                "value": value,
                "worst_scene": int(np.argmax([e.square for e in result])),
                "psnr": spread([e.psnr for e in result], 5),
                "flip": spread([e.flip for e in result], 95),
                "db": round(-10 * math.log10(max(1e-12, float(np.mean([e.square for e in result])))), 3),
                "per_edge": round(float(np.mean([e.per_edge for e in result])), 6),
                "per_covered": round(float(np.mean([e.per_covered for e in result])), 6),
                "revision": revision(),
            }
        )
        if moved := [change for change in changes if math.isfinite(change)]:  # within one texel nothing does
            rows[-1]["flicker"] = spread(moved, 95)
        if fine:
            rows[-1]["per_edge_ideal"] = round(float(np.mean(ideal)), 6)
        report(name, at + 1, len(probe.values))
    return {
        "title": probe.title,
        "quantity": probe.quantity,
        "healthy": probe.healthy,
        "scenes": scenes,
        "rows": rows,
    }


def order_of_disjoint(model: Model, scenes: int, seed: int) -> dict[str, float]:
    """Objects that do not overlap, in two orders: how far apart the pictures are, and a healthy PSNR."""
    most, values, kit = 0.0, [], kit_of(model.manifest)
    for index in range(scenes):
        nodes = kit.apart(rng := rng_of(seed, index))
        first = sized(union_of(nodes), model.manifest)
        second = sized(union_of([nodes[i] for i in rng.permutation(len(nodes))]), model.manifest)
        a, b = _drawn(model, first, True), _drawn(model, second, True)
        most = max(most, float(np.abs(np.asarray(a) - np.asarray(b)).max()))
        values.append(psnr(a, exact_picture(first, model)[0]))
    return {"largest_difference": round(most, 6), "psnr": round(float(np.mean(values)), 3)}


def flicker(model: Model, scenes: int, seed: int) -> dict[str, float]:
    """Change from frame to frame (root mean square) that the exact animation does not have, over its own."""
    ratios: list[float] = []
    index = -1
    while (index := index + 1) < scenes or not ratios:
        frames = [
            sized(f, model.manifest) for f in kit_of(model.manifest).animated(rng_of(seed, index), FRAMES)
        ]
        ratio = _change(model, frames)
        if math.isfinite(ratio):
            ratios.append(ratio)
    return {"mean": round(float(np.mean(ratios)), 5), "worst": round(max(ratios), 5)}


def _change(model: Model, frames: Sequence[Scene], per_side: int = 2) -> float:
    """The ratio of `flicker` of one animation, of whose exact pictures a pixel has so many samples a side."""
    ours = [np.asarray(_drawn(model, f, True), np.float64) for f in frames]
    exact_ones = [exact_picture(f, model, per_side)[0] for f in frames]
    extra = real = 0.0
    for i in range(1, len(frames)):
        change = exact_ones[i] - exact_ones[i - 1]
        extra += float(np.square(ours[i] - ours[i - 1] - change).sum())
        real += float(np.square(change).sum())
    return math.sqrt(extra / real) if real > 0 else math.inf


def arithmetic(model: Model, scenes: int, seed: int) -> dict[str, float]:
    """Largest changes of a picture by threads and skipping, on base scenes."""
    probe = kit_of(model.manifest).probes["objects"]
    ways: dict[str, dict[str, Any]] = {"threads": {"threads": 2}}
    if isinstance(model.network, Framed):
        ways |= {"skipping": {"skip": False}}
    elif not isinstance(model.network, Solids):
        return dict.fromkeys(("threads", "skipping"), 0.0)  # draws whole pictures
    most = dict.fromkeys(ways, 0.0)
    for index in range(scenes):
        scene = scene_of(probe, 4, index, seed, model)
        program = compile_scene(scene, model=model.manifest.name, codes=model.codes)
        base = np.asarray(picture_of(model, program))
        for name, options in ways.items():
            other = np.asarray(picture_of(model, program, **options))
            most[name] = max(most[name], float(np.abs(other - base).max()))
    return {k: round(v, 7) for k, v in most.items()}


INVARIANTS: dict[str, Callable[[Model, int, int], dict[str, float]]] = {
    "order_of_disjoint": order_of_disjoint,
    "flicker": flicker,
    "arithmetic": arithmetic,
}


def run_stability(
    model: Model,
    scenes: int,
    seed: int,
    only: tuple[str, ...] = (),
    report: Report = silent,
    known: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """The whole suite, or the probes and invariants named by ``only``.

    Earlier results that are ``known`` are not measured again; ValueError if of other weights or another seed.
    For JSON: ``probes`` and ``invariants`` by name, and what was measured on what.
    """
    started = time.perf_counter()
    rows: dict[str, list[Row]] = {}
    probes: dict[str, dict[str, Any]] = {}
    invariants: dict[str, Any] = {}
    for earlier in known:
        if (earlier["weights"], earlier["seed"]) != (model.digest, seed):
            raise ValueError("an earlier result is of other weights or another seed")
        invariants |= earlier["invariants"]
        for name, probe in earlier["probes"].items():
            probes[name] = {"scenes": earlier["scenes"], **probe}
            if probes[name]["scenes"] == scenes:
                rows[name] = rows.get(name, []) + [
                    {"revision": earlier.get("revision", "unknown"), **row} for row in probe["rows"]
                ]
    for name in kit_of(model.manifest).probes:
        if not only or name in only:
            probes[name] = run_probe(model, name, scenes, seed, report, rows.get(name, ()))
    for name, measure in INVARIANTS.items():
        if name not in invariants and (not only or name in only):
            invariants[name] = measure(model, scenes, seed)
            report(name, 1, 1)
    return {
        "model": model.manifest.name,
        "weights": model.digest,
        "scenes": scenes,
        "seed": seed,
        **about(),
        "seconds": round(time.perf_counter() - started, 1),
        "probes": {n: probes[n] for n in kit_of(model.manifest).probes if probes.get(n, {}).get("rows")},
        "invariants": invariants,
    }


HARDLY, SLACK = 40.0, 1.0  # dB, of mean PSNR
WARP = SETS["shapes2d"].warp
SCALES = 0.2, 0.55  # of the base set
WARP_OF, SCALES_OF = {2: WARP, 3: SOLID_WARP}, {2: SCALES, 3: SIDES}


def quantities(dimension: int) -> dict[str, tuple[str, float, float]]:
    """Quantity of a manifest -> the probe that varies it, and factors of either end of its values.

    The ratio of scales of solids says little: rays may pass over what is thinner than 0.01, at any size.
    """
    most, scales = WARP_OF[dimension], SCALES_OF[dimension]
    warp = "warp", most, most
    solid = {
        "twist": warp,
        **{name: (probe, 1.0, 1.0) for name, probe in SOLID.items()},
    }
    return {
        "objects": ("objects", 1.0, 1.0),
        "smooth": ("blends", 1.0, 1.0),
        "twirl": warp,
        "bend": warp,
        "scale": ("size", *scales),
        **({"thin": ("thin", 1.0, 1.0), "texels": ("texels", 1.0, 1.0)} if dimension == 2 else solid),
        "blend": ("deep", scales[1], scales[1]),
    }


SOLID = {"displace": "amount", "frequency": "frequency", "width": "width"}
FROM_NOTHING = {"smooth", "blend", "displace", "frequency", "width", "texels"}  # the probe starts later
BOTH_WAYS = {"twirl", "bend", "twist"}  # the range is the same on either side of 0


def measured_ranges(
    found: Mapping[str, Any], dimension: int = 2
) -> tuple[dict[str, list[float]], dict[str, str]]:
    """Ranges by quantity for a manifest's ``trained``, and lines about what lies beyond for ``measured``.

    There is none where nothing was lost at the last value: a warning would not say why. Nor has a scale a
    lower end where nothing was lost at the first: thin objects are as small one way.
    """
    ranges: dict[str, list[float]] = {}
    lines: dict[str, str] = {}
    for quantity, (name, low_unit, high_unit) in quantities(dimension).items():
        probe = found["probes"].get(name)
        if probe is None:
            continue
        rows = probe["rows"]
        first, last = _healthy(rows, probe["healthy"])
        if last == len(rows) - 1:
            continue
        low, high = rows[first]["value"] * low_unit, rows[last]["value"] * high_unit
        low = 0.0 if quantity in FROM_NOTHING or (quantity == "scale" and first == 0) else low
        if quantity in BOTH_WAYS:
            low = -high
        ranges[quantity] = [int(v) if v == int(v) else round(v, 4) for v in (low, high)]
        below = [] if quantity in BOTH_WAYS | FROM_NOTHING else rows[:first]
        beyond = [*below, *rows[last + 1 :]]
        shown = [beyond[0], beyond[-1]] if len(beyond) > 1 else beyond
        unit = {True: low_unit, False: high_unit}
        said = [
            f"{row['value'] * unit[row['value'] < probe['healthy']]:g}: {row['psnr']['mean']:.1f} dB "
            f"(worst {row['psnr']['worst']:.1f})"
            for row in shown
        ]
        if said:
            lines[quantity] = ", ".join(said)
    return ranges, lines


def _healthy(rows: list[dict[str, Any]], healthy: float) -> tuple[int, int]:
    """The first and the last row, around the healthy one, up to which all is well."""
    centre = next(i for i, row in enumerate(rows) if row["value"] == healthy)
    least = min(HARDLY, rows[centre]["psnr"]["mean"] - SLACK)
    first = last = centre
    while first > 0 and rows[first - 1]["psnr"]["mean"] >= least:
        first -= 1
    while last + 1 < len(rows) and rows[last + 1]["psnr"]["mean"] >= least:
        last += 1
    return first, last
