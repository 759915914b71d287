"""The solids' network in torch: its parameters. What it computes is `scenelang.renderers.solid.network`."""

from __future__ import annotations

import torch
from torch import nn

from scenelang.renderers.arrays_torch import TORCH
from scenelang.renderers.solid.network import SolidConfig, SolidNetwork, solid_shapes


class Solids(nn.Module, SolidNetwork):
    """Parameters of the solids' renderer.

    Args:
        config: sizes.
        geometries: number of geometry codes.
        materials: number of material codes.
    """

    xp = TORCH

    def __init__(self, config: SolidConfig, geometries: int, materials: int) -> None:
        super().__init__()
        self.config = config
        made: dict[str, list[nn.Parameter]] = {"segment_w": [], "segment_b": []}
        for name, shape in solid_shapes(config, geometries, materials).items():
            group, _, index = name.partition(".")
            fan = (config.code + 1) * (shape[1] if index in ("1", "2") else 1)
            value = torch.randn(shape)
            if index:
                scale = fan**-0.5 if group.endswith("w") else 0.3
                made.setdefault(group, []).append(nn.Parameter(value * scale))
            else:
                setattr(self, name, nn.Parameter(value))
        for name, layers in made.items():
            setattr(self, name, nn.ParameterList(layers))
        with torch.no_grad():  # gates begin in their linear range
            self.cell_lines.mul_(0.3)
            self.cell_gain.zero_()
            self.cell_bias.fill_(0.5)
            self.bump.zero_()
            self.candidate.mul_(0.3)
