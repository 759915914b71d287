"""Every way to draw a set's scenes that the frontier measures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import torch

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import Manifest, available, load_manifest
from scenelang.compiler.weights import read_facts
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.how import Sampling
from scenelang.drawing.image import Image, from_samples
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.paper import Streaming, StreamingConfig
from scenelang.drawing.small import choose_drawer, draw_small
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene

FULL = 256  # pixels along a side at which the paper's renderer is timed
TITLES: dict[Sampling, str] = {
    "adaptive": "",
    "four": ", four samples",
    "one": ", one sample",
    "draft": ", draft",
    "quick": ", quick",
}
FIELD, REFERENCE, PAPER = "exact field", "exact reference", "the paper's streaming"
Draw = Callable[[], Image]
Prepare = Callable[[Scene], Draw]
"""Compiles a scene, which is not timed, and returns what draws it, which is."""


@dataclass(frozen=True, slots=True)
class Way:
    """A way to draw; the fields it shares with `scenelang.output.frontier.Point` are said there."""

    name: str
    prepare: Prepare = field(repr=False)  # compiles scenes for it
    backend: Literal["neural", "reference"] = "neural"
    model: str | None = None
    renderer: str = "reference"
    samples: Sampling = "adaptive"
    skip: bool = True
    spp: int = 0
    side: int = 0
    why_not: str | None = None
    drawn: bool = True  # whether there is a picture worth comparing; untrained weights are only timed
    parameters: int = 0
    bytes: int = 0
    command: str | None = None

    @property
    def offered(self) -> bool:
        return self.why_not is None


def ways_of(base: str, threads: int) -> list[Way]:
    """All ways to draw the scenes of a set; RenderError where weights are missing or damaged."""
    manifests = [m for m in map(load_manifest, available()) if m.set == load_manifest(base).set]
    result: list[Way] = []
    for manifest in sorted(manifests, key=lambda m: (m.name != base, m.name)):
        result += _of_model(manifest, base, threads)
    result += [*_references(load_manifest(base)), *_paper(base)]
    return result


def _of_model(manifest: Manifest, base: str, threads: int) -> Iterator[Way]:
    name = manifest.name
    facts = read_facts(name)
    side = manifest.sizes[0][0] if manifest.sizes else 0

    def way(title: str, why_not: str | None = None, **options: Any) -> Way:
        words = [
            f"--{key} {value}" for key, value in options.items() if key != "skip" and value != "adaptive"
        ]
        if manifest.renderer == "reading":
            options["skip"] = False  # every sample reads every object
        line = " ".join(["scenelang render scene.nsg -o scene.png --model", name, *words])
        if side:
            line += f" --size {side}x{side}"
        return Way(
            title,
            _neural(name, side, threads, **options),
            model=name,
            renderer=manifest.renderer,
            side=side,
            why_not=why_not,
            parameters=facts["parameters"],
            bytes=facts["bytes"],
            command=None if why_not else line,
            **options,
        )

    known: dict[str, tuple[Sampling, ...]] = {
        "framed": ("adaptive", "four", "one", "draft"),
        "solid": ("adaptive", "four", "one", "draft", "quick"),
    }
    for samples in known.get(manifest.renderer, ("adaptive",)):
        yield way(name + TITLES[samples], samples=samples)
    if name != base:
        return
    for samples in known.get(manifest.renderer, ()):
        if samples != "draft":
            yield Way(
                FIELD + TITLES[samples],
                _formulas(name, threads, samples),
                renderer=FIELD,
                samples=samples,
                why_not="formulas in place of the network, all else alike",
            )


def _neural(name: str, side: int, threads: int, samples: Sampling = "adaptive", skip: bool = True) -> Prepare:
    """By the library that `render` draws a picture with."""

    def prepare(scene: Scene) -> Draw:
        if side:
            scene = scene.model_copy(update={"canvas": (side, side)})
        program = compile_scene(scene, model=name)
        if choose_drawer(program)[0] == "torch":
            model = open_model(name)
            return lambda: (
                draw_program(program, model, threads=threads, samples=samples, skip=skip, patient=True).image
            )
        return lambda: draw_small(program, threads=threads, samples=samples).image

    return prepare


def _formulas(name: str, threads: int, samples: Sampling) -> Prepare:
    def prepare(scene: Scene) -> Draw:
        program, field = compile_scene(scene, model=name), closed_forms(name)
        return lambda: draw_objects(field, program, threads=threads, samples=samples).image

    return prepare


def paired(base: str) -> list[tuple[str, str]]:
    """Pairs of ways, the slower first, whose times are told as a ratio."""
    pairs = [
        (base + TITLES[samples], FIELD + TITLES[samples]) for samples in ("adaptive", "four", "one", "quick")
    ]
    pairs += [(name + TITLES["four"], name) for name in (base, FIELD)]
    others = f"{PAPER}, {FULL}²", f"{REFERENCE}, 4 spp"
    return pairs + [(other, name) for other in others for name in (base, FIELD)]


def _references(manifest: Manifest) -> Iterator[Way]:
    for per_side, why_not in (
        (2, None),
        (1, "drawn for comparison: the language defines four"),
        (4, "drawn for comparison: the language defines four"),
    )[: 2 if manifest.dimension == 3 else 3]:  # a picture of solids with 16 takes half a minute
        yield Way(
            f"{REFERENCE}, {per_side**2} spp",
            _exact(manifest, per_side),
            backend="reference",
            spp=per_side**2,
            skip=False,
            why_not=why_not,
            command=None if why_not else "scenelang render scene.nsg -o scene.png --backend reference",
        )


def _exact(manifest: Manifest, per_side: int) -> Prepare:
    def prepare(scene: Scene) -> Draw:
        graph = lower(scene.model_copy(update={"model": manifest.name}), manifest, None, Diagnostics())
        return lambda: reference_image(graph, per_side=per_side)

    return prepare


def _paper(base: str) -> Iterator[Way]:
    """The paper's streaming renderer at the full size, untrained: what a frame of it takes."""
    for width, title in ((1.0, PAPER), (1 / 8, "streaming, 1/8 of the filters")):
        yield Way(
            f"{title}, {FULL}²",
            _untrained(base, width),
            renderer="streaming",
            why_not="random weights, to take its time",
            drawn=False,
            parameters=sum(p.numel() for p in _random(width).parameters()),
        )


@lru_cache(maxsize=4)
def _random(width: float) -> Streaming:
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(1)
        made = Streaming(StreamingConfig(resolution=FULL, width=width)).requires_grad_(False).eval()
    made.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    return made


def _untrained(base: str, width: float) -> Prepare:
    def prepare(scene: Scene) -> Draw:
        program = compile_scene(scene, model=base)
        vectors = torch.from_numpy(program.vectors.copy())[None]
        tokens = torch.from_numpy(program.tokens.astype(np.int64))[None]
        return lambda: from_samples(
            _random(width)(vectors, tokens)[0].permute(1, 2, 0).clamp(0, 1).numpy(), None
        )

    return prepare
