"""Grids that correct learned distances far from outlines, which leaves that grow and shells show.

    python -m lab.levels shapes2d

Decoders are trained to be right near outlines, and off by a thousandth of the distance elsewhere. What they
are short of at the nodes of a grid is kept beside their weights; between nodes it is linear.
"""

from __future__ import annotations

import json
import sys

import numpy as np
from safetensors.numpy import save

from scenelang.assets.files import write_whole
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.manifest import load_manifest, model_folder
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import EXTENT, LEVEL_NODES, FramedArrays


def corrections(network: FramedArrays, names: tuple[str, ...]) -> np.ndarray:
    """Exact less learned distances (leaves, nodes, nodes), leaf units, float16."""
    axis = np.linspace(-EXTENT, EXTENT, LEVEL_NODES).astype(np.float32)
    p = np.stack(np.meshgrid(axis, axis, indexing="ij")).reshape(2, -1)
    result = []
    for name, decoder in zip(names, network.decoders(network.codes), strict=True):
        learned = network.decode(p, np.hypot(*p), 1.0, decoder)[0]
        exact = GEOMETRIES[name].distance(p.astype(np.float64))
        result.append((exact - learned).reshape(LEVEL_NODES, -1).astype(np.float16))
    return np.stack(result)


def main() -> None:
    for name in sys.argv[1:]:
        network, digest = load_arrays(name)
        assert isinstance(network, FramedArrays)
        header = json.dumps({"format": 1, "weights": digest})
        levels = {"levels": corrections(network, load_manifest(name).geometries)}
        write_whole(model_folder(name) / "levels.safetensors", save(levels, {"scenelang": header}))


if __name__ == "__main__":
    main()
