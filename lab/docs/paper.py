"""Figures that the paper reports, to be printed beside ours.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021,
supplementary material, Tables 1, 2 and 4: PSNR in dB, SSIM, LPIPS, FLIP, each the mean of 1,000 random
scenes of its own sets, after up to 1.6 million iterations on graphics processors.
"""

from __future__ import annotations

from typing import NamedTuple


class Figures(NamedTuple):
    """A line of a table."""

    psnr: float
    ssim: float
    lpips: float
    flip: float


MATERIAL_SIZES: dict[int, Figures] = {
    1: Figures(20.55, 0.867, 0.185, 0.141),
    2: Figures(21.59, 0.882, 0.154, 0.127),
    4: Figures(26.15, 0.933, 0.080, 0.083),
    8: Figures(29.56, 0.968, 0.038, 0.060),
    16: Figures(29.43, 0.966, 0.041, 0.062),
    32: Figures(29.89, 0.968, 0.037, 0.060),
    64: Figures(28.86, 0.960, 0.048, 0.057),
}
"""Table 1: numbers of a material vector; squares with one of 16 textures, 256 x 256, d_g = 32."""

GEOMETRY_SIZES: dict[int, Figures] = {
    1: Figures(18.25, 0.820, 0.523, 0.285),
    2: Figures(18.40, 0.820, 0.521, 0.274),
    4: Figures(19.65, 0.823, 0.471, 0.211),
    8: Figures(21.49, 0.835, 0.375, 0.160),
    16: Figures(28.92, 0.942, 0.076, 0.054),
    32: Figures(28.77, 0.939, 0.073, 0.053),
    64: Figures(28.43, 0.934, 0.082, 0.056),
}
"""Table 1: numbers of a geometry vector; bunny, teapot and monkey, 128 x 128, d_m = 32."""

SHAPES = Figures(35.91, 0.984, 0.007, 0.050)
"""Table 2, left: up to four deformed shapes, 256 x 256."""

SOLIDS = Figures(36.41, 0.982, 0.007, 0.049)
"""Table 2, right: up to three spheres and tori, diffuse or volumetric, 256 x 256."""

STREAMING = Figures(30.52, 0.967, 0.010, 0.058)
READING = Figures(30.65, 0.968, 0.011, 0.059)
"""Table 4: the two renderers."""
