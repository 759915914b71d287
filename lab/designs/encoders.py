"""The paper's lifting: small networks turn a transformation's numbers into the matrix it acts by.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021, section 3:
an element is a learned vector, a transformation a matrix from an encoder of its own, and a chain the product
of its matrices: g = T_n … T_1 g_0, m likewise. One encoder takes all affine maps (16 numbers of a 4 x 4
matrix), one each twirl and bend, one each the colour operations; textures' affine maps have their own.

Letters: M transformations, d the size of the vector that a matrix acts on, W = `width`.

`scenelang.lifting.learned` applies the same networks without torch.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from scenelang.lifting.learned import GEOMETRY_INPUTS, MATERIAL_INPUTS


@dataclass(frozen=True, slots=True)
class LiftingConfig:
    """Sizes of the lifting."""

    geometry: int = 32  # numbers d_g of a geometry vector, 1 to 64
    material: int = 32  # numbers d_m of a material vector, 1 to 64
    width: int = 64  # hidden units W of each encoder's two layers


class Encoder(nn.Module):
    """A transformation's numbers to the matrix it acts by: the identity plus what a network adds.

    Two hidden layers of rectified linear units; the last layer starts small, so that long chains neither
    vanish nor grow before anything is learned.

    Args:
        inputs: numbers of a transformation.
        width: hidden units W.
        size: rows and columns d of the matrix.
    """

    def __init__(self, inputs: int, width: int, size: int) -> None:
        super().__init__()
        self.size = size
        self.layers = nn.ModuleList(
            [nn.Linear(inputs, width), nn.Linear(width, width), nn.Linear(width, size * size)]
        )
        last = self.layers[-1]
        assert isinstance(last, nn.Linear)
        nn.init.normal_(last.weight, std=0.3 / (width * size) ** 0.5)
        nn.init.zeros_(last.bias)

    def forward(self, numbers: Tensor) -> Tensor:
        """Matrices (M, d, d) of transformations (M, inputs)."""
        first, second, last = self.layers
        hidden = torch.relu(second(torch.relu(first(numbers))))
        change: Tensor = last(hidden).view(-1, self.size, self.size)
        return change + torch.eye(self.size, dtype=change.dtype, device=change.device)


class Encoders(nn.Module):
    """Learned vectors of the elements and encoders of the transformations.

    Args:
        config: sizes.
        geometries: number of leaf geometries.
        materials: number of materials.
    """

    def __init__(self, config: LiftingConfig, geometries: int, materials: int) -> None:
        super().__init__()
        self.config = config
        self.codes = nn.Parameter(torch.randn(geometries, config.geometry))
        self.material_codes = nn.Parameter(torch.randn(materials, config.material))
        self.geometry = nn.ModuleDict(  # of geometry transformations (M, inputs)
            {kind: Encoder(n, config.width, config.geometry) for kind, n in GEOMETRY_INPUTS.items()}
        )
        self.material = nn.ModuleDict(  # of colour operations (M, inputs)
            {kind: Encoder(n, config.width, config.material) for kind, n in MATERIAL_INPUTS.items()}
        )
