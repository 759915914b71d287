"""glTF documents for tests, made by hand, and what the importer makes of them."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

import scenelang as nsg
from scenelang.graph.affine import compose
from scenelang.graph.lower import step_of
from scenelang.graph.spaces import SPACES
from scenelang.graph.steps import IDENTITY, Affine, Rows
from scenelang.interchange.gltf import Imported, import_gltf
from scenelang.interchange.gltf_file import parse_gltf

Json = dict[str, Any]


def document(nodes: list[Json], **further: Any) -> Json:
    """A glTF document whose first scene has the first node; every mesh is one triangle."""
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "bufferView": 0}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + TRIANGLE}],
        **further,
    }


TRIANGLE = base64.b64encode(np.eye(3, dtype=np.float32).tobytes()).decode()


def write(folder: Path, data: Json, name: str = "a.gltf") -> Path:
    path = folder / name
    path.write_text(json.dumps(data), "utf-8")
    return path


def read(data: Json, **options: Any) -> Imported:
    return import_gltf(parse_gltf(json.dumps(data).encode()), **options)


def world(node: Any, dimension: int, outer: Rows = IDENTITY) -> list[tuple[str, np.ndarray]]:
    """Geometry and world matrix of every object, in order, through the compiler's own steps."""
    rows = IDENTITY
    for transform in node.transforms:
        step = step_of(transform, SPACES[dimension])
        assert isinstance(step, Affine), step
        rows = compose(step.rows, rows)
    rows = compose(outer, rows)
    if isinstance(node, nsg.Object):
        return [(node.geometry, np.array([*rows, 0, 0, 0, 1]).reshape(4, 4))]
    return [found for child in node.children for found in world(child, dimension, rows)]


def objects(scene: nsg.Scene, dimension: int = 2) -> list[tuple[str, np.ndarray]]:
    return [found for node in scene.nodes for found in world(node, dimension)]
