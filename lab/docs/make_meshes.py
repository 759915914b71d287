"""Make the elements that ship, ``import "std/meshes"``, again: ``python -m lab docs meshes FOLDER``.

FOLDER holds what ``npm pack bunny@1.0.1 three@0.187.0 @pmndrs/assets@1.7.0`` fetches; ``pip install DracoPy``
unpacks the last one's mesh. The meshes are written into it as files, which the exact picture asks for
(``--originals FOLDER``), and made elements of the package. The same packages give the same bytes.

- *bunny*: the Stanford bunny (3,674 triangles), as npm ``bunny`` has it, which calls it public domain. The
  scan is Stanford's, who ask for credit, and for permission before models are used commercially.
- *teapot*: Martin Newell's patches, in the public domain, as three.js (MIT) has them, in 1,600 squares each;
  the lid is made to meet the rim.
- *monkey*: Blender's Suzanne, subdivided (14,842 triangles), as ``@pmndrs/assets`` has it under CC0 1.0.
"""

from __future__ import annotations

import base64
import io
import json
import re
import sys
import tarfile
from pathlib import Path

import numpy as np
import trimesh

from lab import ROOT
from scenelang.inverse.learn import LearnOptions, learn_files

OUT = ROOT / "scenelang/language/std/meshes.safetensors"
ERROR = 0.00004  # which takes 193 distances a side
SQUARES = 40  # along a side of a patch
LID = slice(20, 28)  # patches
FIT = 1.077  # how much wider the lid has to be
SAID = {
    "bunny.obj": (
        "public domain by its package; Stanford asks for credit, and for permission before commercial use",
        "Stanford Computer Graphics Laboratory, by npm bunny 1.0.1",
    ),
    "teapot.obj": ("public domain", "Martin Newell 1975, by npm three 0.187.0 (MIT)"),
    "monkey.obj": ("CC0 1.0", "Suzanne, Blender Foundation, by npm @pmndrs/assets 1.7.0"),
}


def text_of(folder: Path, package: str, name: str) -> str:
    """A file of a package."""
    (path,) = folder.glob(f"{package}-*.tgz")
    with tarfile.open(path) as packed:
        file = packed.extractfile(f"package/{name}")
        assert file is not None
        return file.read().decode()


def obj(vertices: np.ndarray, faces: np.ndarray) -> str:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()), ""])


def bunny(source: str) -> str:
    positions, cells = (
        json.loads(re.search(rf"exports\.{name}=(\[\[.*?\]\])", source)[1])  # type: ignore[index]
        for name in ("positions", "cells")
    )
    return obj(np.array(positions), np.array(cells))


def teapot(source: str) -> str:
    patches, vertices = (
        np.array(
            re.sub(r"/\*.*?\*/|\s", "", re.search(rf"{name} = \[(.*?)\];", source, re.S)[1]).split(","),  # type: ignore[index]
            float,
        )
        for name in ("teapotPatches", "teapotVertices")
    )
    corners = vertices.reshape(-1, 3)[patches.reshape(-1, 4, 4).astype(int)]
    corners[LID, ..., :2] *= FIT
    t = np.linspace(0, 1, SQUARES + 1)[:, None]
    weights = np.array([1, 3, 3, 1]) * t ** np.arange(4) * (1 - t) ** np.arange(3, -1, -1)
    x, y, z = np.moveaxis(np.einsum("ui,vj,pijk->puvk", weights, weights, corners), 3, 0).reshape(3, -1)
    side = SQUARES + 1
    first = (np.arange(len(corners))[:, None, None] * side + np.arange(SQUARES)[:, None]) * side
    a = (first + np.arange(SQUARES)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + side + 1], 1), np.stack([a, a + side + 1, a + side], 1)])
    return obj(np.stack([x, z, -y], 1), faces)


def main(folder: Path) -> None:
    (folder / "bunny.obj").write_text(bunny(text_of(folder, "bunny", "index.js")))
    source = text_of(folder, "three", "examples/jsm/geometries/TeapotGeometry.js")
    (folder / "teapot.obj").write_text(teapot(source))
    monkey = text_of(folder, "pmndrs-assets", "models/suzi.glb.js")
    data = base64.b64decode(re.search(r"base64,([^']+)'", monkey)[1])  # type: ignore[index]
    mesh = trimesh.load_scene(io.BytesIO(data), file_type="glb").to_mesh()
    (folder / "monkey.obj").write_text(obj(mesh.vertices, mesh.faces))
    OUT.unlink(missing_ok=True)
    for name, (license, source) in SAID.items():
        learn_files(
            [folder / name], OUT, LearnOptions(max_error=ERROR, license=license, source=source), say=print
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
