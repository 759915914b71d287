"""The textures and the meshes that ship, what else may stand in their place, and what that takes."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.elements.element import Element
from scenelang.elements.picture import painted, texels
from scenelang.elements.pyramid import packed, refine
from scenelang.elements.textures import load_textures
from scenelang.evaluate.evaluation import loads
from scenelang.files import write_whole
from scenelang.fitting.ladder import Shape, fit
from scenelang.fitting.originals import originals_of
from scenelang.fitting.picture import Picture, fit_picture
from scenelang.graph.lower import lower
from scenelang.lab.codes.decoder import decoded
from scenelang.lab.codes.forms import REACH, Array, best_form, off
from scenelang.models.load import Model, load_model

CELLS, LEVELS = 6, 5  # of grids of distances
SEEDS: Final = (1, 2)  # of codes and their decoder
MODELS: Final = {"textures": "shapes2d", "meshes": "solids3d"}
ERRORS: Final = {
    "textures": (0.1, 0.03),
    "meshes": (0.01, 0.003, 0.001),
}  # of elements beside those that ship


class Way(NamedTuple):
    """One way to give all textures or meshes.

    Args:
        kind: codes, forms or elements.
        d: numbers of each; of elements their bytes, mean.
        said: further of the record.
        elements: what draws it, by name.
    """

    kind: str
    d: int
    said: dict[str, Any]
    elements: dict[str, Element]

    @property
    def label(self) -> str:
        """Its own among the ways of a world."""
        return "-".join(str(v) for v in (self.kind, self.d, self.said.get("seed", "")) if v)


@dataclass(frozen=True)
class World:
    """The textures or the meshes.

    Args:
        shipped: elements that ship, by name.
        true: colours (h, w, 3) or distances (n, n, n) of each.
        shapes: the solids themselves, by name.
    """

    what: str
    model: Model
    shipped: dict[str, Element]
    true: dict[str, Array]
    shapes: dict[str, Shape]

    def element(self, name: str, values: Array) -> Element:
        """What draws colours or distances."""
        if self.what == "textures":
            return painted(name, np.rint(255 * values.clip(0, 1)).astype(np.uint8))
        grid, steps = None, []
        for side in [CELLS * 2**level + 1 for level in range(LEVELS)]:
            if side <= len(values):
                every = (slice(None, None, (len(values) - 1) // (side - 1)),) * 3
                grid, step = refine(grid, side, 3, lambda _, every=every: values[every])  # type: ignore[misc]
                steps.append(step)
        return packed(name, CELLS, steps, {})

    def learned(self, name: str, error: float) -> Element:
        """What ``scenelang learn --max-error`` makes of one."""
        if self.what == "meshes":
            return fit(self.shapes[name], name, max_error=error)[0]
        return fit_picture(Picture(np.rint(255 * self.true[name]).astype(np.uint8)), name, max_error=error)[0]

    def ways(
        self, sizes: tuple[int, ...], beyond: tuple[int, ...], seconds: float, kept: Path
    ) -> Iterator[Way]:
        """Every way, made as it is asked for.

        Args:
            sizes: numbers of a code and of a form.
            beyond: further numbers of a form.
            seconds: of processor time that a decoder is trained.
            kept: folder of what was trained.
        """
        for d in (*sizes, *beyond):
            forms = {name: best_form(values, d) for name, values in self.true.items()}
            won = [form for form, _ in forms.values()]
            counts = {form: won.count(form) for form in sorted({*won})}
            yield self._way("forms", d, {n: values for n, (_, values) in forms.items()}, forms=counts)
        for error in (*ERRORS[self.what], None):
            made = self.shipped if error is None else {name: self.learned(name, error) for name in self.true}
            mean = sum(len(element.data) for element in made.values()) / len(made)
            yield Way("elements", round(mean), {"max_error": error, "shipped": error is None}, made)
        for seed in SEEDS:
            for d in sizes if seed == SEEDS[0] else sizes[::3]:  # what another seed makes of it
                found, said = self._codes(d, seed, seconds, kept)
                yield self._way("codes", d, dict(zip(self.true, found, strict=True)), seed=seed, **said)

    def _way(self, kind: str, d: int, arrays: dict[str, Array], **said: Any) -> Way:
        error = np.mean([off(values, self._like(name, values)) for name, values in arrays.items()])
        elements = {name: self.element(name, values) for name, values in arrays.items()}
        return Way(kind, d, {**said, "off": round(float(error), 5)}, elements)

    def _like(self, name: str, values: Array) -> Array:
        """The truth where values are: of a coarser grid every so many nodes."""
        every = (len(self.true[name]) - 1) // (len(values) - 1)
        return self.true[name][(slice(None, None, every),) * (3 if self.what == "meshes" else 2)]

    def _codes(self, d: int, seed: int, seconds: float, kept: Path) -> tuple[Array, dict[str, Any]]:
        """What codes give, trained once; of solids at every second node."""
        path = kept / f"{self.what}-{d}-{seed}-{seconds:g}s.npz"
        if not path.exists():
            true = np.stack([*self.true.values()])
            if self.what == "textures":
                found, said = decoded(true, d, seed, seconds, pitch=6.0)
            else:
                true = np.ascontiguousarray(true[:, ::2, ::2, ::2, None])
                found, said = decoded(true, d, seed, seconds, pitch=2.0, reach=REACH)
            save_arrays(path, found.astype(np.float16), said)
        found, said = load_arrays(path)
        return found if self.what == "textures" else found[..., 0], said


def save_arrays(path: Path, found: Array | npt.NDArray[np.float16], said: dict[str, Any]) -> None:
    """Write an array and what there is to say of it, whole or not at all."""
    data = io.BytesIO()
    np.savez(data, found=found, said=np.array(json.dumps(said)))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, data.getvalue())


def load_arrays(path: Path) -> tuple[Array, dict[str, Any]]:
    """What `save_arrays` wrote, in float32."""
    with np.load(path, allow_pickle=False) as file:
        return file["found"].astype(np.float32), json.loads(str(file["said"]))


def world(what: str, kept: Path) -> World:
    """The textures that ship, or the meshes of `std/meshes`, whose originals have to be at hand.

    Args:
        kept: folder that gets the meshes' distances, which take a minute.

    Raises:
        FitError: the original of a mesh is not there.
    """
    model = load_model(MODELS[what])
    if what == "textures":
        shipped = load_textures()
        return World(what, model, shipped, {name: texels(e) for name, e in shipped.items()}, {})
    scene = loads('import "std/meshes" as m; m.bunny; m.monkey; m.teapot;')
    graph = lower(scene, model.manifest, None, Diagnostics())
    found = {e.name: e for e in graph.elements.values()}
    shapes = {name.partition(".")[2]: shape for name, shape in originals_of(scene, graph).items()}
    path = kept / f"distances-{'-'.join(found[name].digest[:8] for name in shapes)}.npz"
    if not path.exists():
        axis = np.linspace(-1, 1, CELLS * 2 ** (LEVELS - 1) + 1)
        at = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)
        grids = [shape.distances(at.reshape(-1, 3)).reshape(at.shape[:3]) for shape in shapes.values()]
        save_arrays(path, np.stack(grids).astype(np.float32), {})
    return World(what, model, found, dict(zip(shapes, load_arrays(path)[0], strict=True)), shapes)
