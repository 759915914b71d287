"""Figures that the paper reports, to be printed beside ours.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021,
supplementary material, Tables 1 and 2: PSNR in dB, SSIM, FLIP, each the mean of 1,000 random scenes of its
own sets, after up to 1.6 million iterations on graphics processors.
"""

from __future__ import annotations

from typing import NamedTuple


class Figures(NamedTuple):
    """A line of a table."""

    psnr: float
    ssim: float
    flip: float


TEXTURES = Figures(29.89, 0.968, 0.060)
"""Table 1: squares with one of 16 textures, 256 x 256, by 32 numbers a material."""
SHAPES = Figures(35.91, 0.984, 0.050)
"""Table 2, left: up to four deformed shapes, 256 x 256."""
SOLIDS = Figures(36.41, 0.982, 0.049)
"""Table 2, right: up to three spheres and tori, diffuse or volumetric, 256 x 256."""
