"""The Scene: concrete, validated, frozen. Text evaluates to one; Python and JSON callers build one.

Angles are radians, lengths world units, colours numbers in [0, 1] as written (sRGB in 2D). Spans do not
live here: the evaluator returns a `SpanMap` beside the Scene, keyed by `id()` of the node.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from scenelang.language.diagnostics import plural
from scenelang.language.nodes import MAX_FRAMES as MAX_FRAMES
from scenelang.language.nodes import MAX_NODE_DEPTH as MAX_NODE_DEPTH
from scenelang.language.nodes import Animation as Animation
from scenelang.language.nodes import Bend as Bend
from scenelang.language.nodes import Boolean as Boolean
from scenelang.language.nodes import Camera as Camera
from scenelang.language.nodes import Chain as Chain
from scenelang.language.nodes import Color as Color
from scenelang.language.nodes import Displace as Displace
from scenelang.language.nodes import Flip as Flip
from scenelang.language.nodes import Grayscale as Grayscale
from scenelang.language.nodes import Ground as Ground
from scenelang.language.nodes import Group as Group
from scenelang.language.nodes import Hue as Hue
from scenelang.language.nodes import Light as Light
from scenelang.language.nodes import Link as Link
from scenelang.language.nodes import Material as Material
from scenelang.language.nodes import MaterialOp as MaterialOp
from scenelang.language.nodes import Matrix as Matrix
from scenelang.language.nodes import Object as Object
from scenelang.language.nodes import Rotate as Rotate
from scenelang.language.nodes import Scale as Scale
from scenelang.language.nodes import SceneNode as SceneNode
from scenelang.language.nodes import Shear as Shear
from scenelang.language.nodes import Transform as Transform
from scenelang.language.nodes import Translate as Translate
from scenelang.language.nodes import Twirl as Twirl
from scenelang.language.nodes import Twist as Twist
from scenelang.language.scene_data import Elements as Elements
from scenelang.language.scene_data import SceneData
from scenelang.language.scene_data import load_elements as load_elements
from scenelang.language.words import STAGE


class Scene(SceneData):
    """A whole scene: settings and top-level nodes, which form a union in file order."""

    def __repr__(self) -> str:
        """In short; `to_nsg` has all of it."""
        waiting, count = list(self.nodes), 0
        while waiting:
            node = waiting.pop()
            if isinstance(node, Object):
                count += 1
            else:
                waiting += [child.node if isinstance(child, Link) else child for child in node.children]
        width, height = self.canvas
        model = f", {self.model}" if self.model else ""
        frame = f", a frame of {self.animation.frames:,}" if self.animation else ""
        return f"Scene({plural(count, 'object')}, {width} x {height}{model}{frame})"

    __str__ = __repr__

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        count = len(self.nodes)
        from scenelang.assets.notebook import bundle

        return bundle(self, self.canvas, f"Scene of {plural(count, 'node')}")

    def to_nsg(self) -> str:
        """Canonical text that evaluates back to an equal Scene."""
        from scenelang.language.scene_text import to_nsg

        return to_nsg(self)

    def to_json(self) -> str:
        """JSON that `from_json` reads back; like `model_dump_json`, and for scenes of any depth."""
        from scenelang.language.scene_json import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, text: str | bytes, root: str | os.PathLike[str] | None = None) -> Scene:
        """Read JSON; like `model_validate_json`, and for scenes of any depth.

        Args:
            text: the JSON.
            root: the folder of its files of elements, which are not read without it.

        Raises:
            SceneError: text that is not JSON, not a Scene, or has elements that cannot be read; it names each
                place.
        """
        from scenelang.language.scene_json import from_json

        return from_json(text, cls, None if root is None else Path(root))


def same_nodes(a: Scene, b: Scene) -> bool:
    """Test whether two frames hold the very same nodes, on one stage."""
    return (
        len(a.nodes) == len(b.nodes)
        and all(getattr(a, name) == getattr(b, name) for name in ("canvas", "background", *STAGE))
        and all(x is y for x, y in zip(a.nodes, b.nodes, strict=True))
    )
