"""The spaces that models draw in, by their dimension."""

from __future__ import annotations

from typing import Final

from scenelang.graph.plane import Plane
from scenelang.graph.solid import Solid
from scenelang.graph.space import Space

PLANE: Final = Plane()
SPACES: Final[dict[int, Space]] = {2: PLANE, 3: Solid()}
