"""Seeded scenes with params whose true values only a picture knows, and how often these are found."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from lab.about import Report, about, silent
from lab.sets.plane import SETS, Rng, random_scene
from lab.sets.scenes import interval
from lab.sets.solids import SOLID_SETS, random_solid
from scenelang.assets.records import Record
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import over_white, psnr
from scenelang.inverse.fit import FittedNumber, fit
from scenelang.language.diagnostics import SourceFile
from scenelang.language.evaluation import loads
from scenelang.output.frontier import reference_of

FAR_DB: Final = 25.0
"""A start's picture is at most so near to the target."""
FELT_DB: Final = 42.0
"""A param's start leaves the picture at most so near where all others are true: 3 dB short of `NEAR_DB`."""
NEAR_DB: Final = 45.0
NEAR: Final = 0.01  # shares of a range
PLANE: Final = ("shapes2d", "chains", "groups", "tree")
SOLID: Final = ("mixed",)
TURN: Final = (-180.0, 180.0)
_BOTH: Final = {"twirl": (-0.8, 0.8), "bend": (-0.8, 0.8), "rotate": TURN, "color": (0.1, 1.0)}
_RANGES: Final = {
    2: {**_BOTH, "scale": (0.2, 0.55), "translate": (-0.7, 0.7)},
    3: {
        **_BOTH,
        "twist": (-0.8, 0.8),
        "scale": (0.35, 0.85),
        "translate": (-0.72, 0.72),
        "position": (2.0, 4.0),
        "power": (15.0, 40.0),
    },
}
"""From where to where the numbers of random scenes go, by the word before them."""
_NUMBER: Final = re.compile(r"(?<![\w.#-])-?\d+(?:\.\d+)?(?:e-?\d+)?(rad|deg)?(?![\w.])")
_WORD: Final = re.compile(r"\b(\w+)(?:\(| = )")


class FitCase(Record):
    """A scene to be fitted."""

    set: str
    text: str  # its params start at their defaults
    truth: dict[str, float]  # the target's values, as shares of their ranges
    target: Image  # exact, 8 bits a channel, (H, W, 3) in [0, 1]
    start_db: float  # how near the start's picture is to it


def measure(
    model: str, counts: Sequence[int], scenes: int, seed: int, side: int, report: Report = silent
) -> dict[str, Any]:
    """Fit seeded scenes of so many params in turn; shares found, and processor seconds of each."""
    manifest = load_manifest(model)
    rows: list[dict[str, Any]] = []
    for index in range(scenes):
        report("fitting", index, scenes)
        case = random_case(manifest, index, counts[index % len(counts)], seed, side)
        started = time.process_time()
        result = fit(SourceFile("scene", case.text), case.target, seed=seed)
        spent = time.process_time() - started
        off = max(_off(number, case.truth[number.label]) for number in result.numbers)
        rows.append(
            {
                "set": case.set,
                "params": len(case.truth),
                "start_db": round(case.start_db, 2),
                "db": round(result.psnr, 2),
                "off": round(off, 5),
                "found": bool(off <= NEAR or result.psnr >= NEAR_DB),
                "done": result.done,
                "frames": result.frames,
                "seconds": round(spent, 2),
            }
        )
    return {
        **about(),
        "model": model,
        "set": " ".join(SOLID if manifest.dimension == 3 else PLANE),
        "seed": seed,
        "scenes": scenes,
        "side": side,
        "params": list(counts),
        "found": sum(row["found"] for row in rows),
        "share": round(float(np.mean([row["found"] for row in rows])), 4),
        "interval": interval([float(row["found"]) for row in rows]),
        "median_seconds": round(float(np.median([row["seconds"] for row in rows])), 2),
        "median_frames": int(np.median([row["frames"] for row in rows])),
        "cases": rows,
    }


def _off(number: FittedNumber, truth: float) -> float:
    """Distance of a value from the true one, in shares of its range, modulo a full turn."""
    off = abs((number.value - number.low) / (number.high - number.low) - truth)
    return min(off, 1 - off) if math.isclose(number.high - number.low, math.tau, rel_tol=1e-6) else off


def random_case(manifest: Manifest, index: int, count: int, seed: int, side: int) -> FitCase:
    """A scene with so many params, drawn again until its start is far off and every param is felt."""
    for attempt in range(10_000):
        rng = np.random.default_rng([seed, index, count, attempt])
        if (case := _case(manifest, rng, index, count, side)) is not None:
            return case
    raise RuntimeError(f"no scene of {count} params whose start is far off")


def _case(manifest: Manifest, rng: Rng, index: int, count: int, side: int) -> FitCase | None:
    names, ranges = (SOLID if manifest.dimension == 3 else PLANE), _RANGES[manifest.dimension]
    name = names[index % len(names)]
    made = random_solid(rng, SOLID_SETS[name]) if manifest.dimension == 3 else random_scene(rng, SETS[name])
    text, word, slots = made.to_nsg(), "", []
    for line in re.finditer(r"[^\n]+", text):
        words = {result.end(): result[1] for result in _WORD.finditer(line[0])}
        for result in _NUMBER.finditer(line[0]):
            word = next((w for end, w in reversed(words.items()) if end <= result.start()), word)
            low, high = ranges.get(word, (1.0, 0.0))
            value = float(result[0].removesuffix(result[1] or ""))
            value = math.degrees(value) if result[1] == "rad" else value
            if low <= value <= high and bool(result[1]) == (word == "rotate"):
                slots.append((line.start() + result.start(), line.start() + result.end(), value, (low, high)))
        word = next(reversed(words.values()), word)
    if len(slots) < count:
        return None
    truth, head = {}, []
    chosen = sorted(rng.choice(len(slots), count, replace=False).tolist())
    for number, at in enumerate(chosen):
        low, high = slots[at][3]
        unit = "deg" if slots[at][3] == TURN else ""
        start = float(rng.uniform(low, high))
        truth[f"p{number}"] = (slots[at][2] - low) / (high - low)
        head.append(f"param p{number} = {start:.6f}{unit} in {low}{unit}..{high}{unit};")
    for number, at in reversed(list(enumerate(chosen))):
        text = f"{text[: slots[at][0]]}p{number}{text[slots[at][1] :]}"
    text = text.replace("nsg 1;\n", "nsg 1;\n" + "\n".join(head) + "\n", 1)

    def exact(sized: int, given: dict[str, Any]) -> Image:
        scene = loads(text, params=given)
        factor = sized / min(scene.canvas)
        scene = scene.sized((round(scene.canvas[0] * factor), round(scene.canvas[1] * factor)))
        return over_white(reference_of(scene, manifest)).view(Image)

    values = {name: _given(truth[name], *slots[at][3]) for name, at in zip(truth, chosen, strict=True)}
    small = side // 4
    try:
        goal = exact(small, values)
        start_db = psnr(exact(small, {}), goal)
        if start_db > FAR_DB:
            return None
        for param in values:
            others = {other: value for other, value in values.items() if other != param}
            if psnr(exact(small, others), goal) > FELT_DB:
                return None
        target = exact(side, values)
    except ValueError:  # the eye is inside something opaque
        return None
    return FitCase(name, text, truth, (np.floor(target * 255 + 0.5) / 255).view(Image), start_db)


def _given(share: float, low: float, high: float) -> Any:
    value = low + share * (high - low)
    return f"{value!r}deg" if (low, high) == TURN else value
