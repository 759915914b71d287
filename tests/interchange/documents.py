"""glTF documents for tests, made by hand."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

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
