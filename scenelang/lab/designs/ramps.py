"""A beginning for the streaming renderer's deconvolutions where frames are exact: leaf coordinates as maps.

An exact vector holds the inverse frame (a b s; c d t) of its object, so the leaf coordinates of a pixel at
x, y, (a x + b y + s, c x + d y + t), are linear in it. A deconvolution of stride 2 can carry them down to the
next resolution without error: a child's coordinates are its parent's, and a quarter of the parent's width
times a, b, c and d. Rectified linear units let a coordinate pass as two channels, its positive and its
negative part, and all else with a constant added. What a random beginning has to find through six layers is
thereby there at the start and free to change; shapes, booleans and colours are learned. Layers and their
shapes stay those of the paper.
"""

from __future__ import annotations

import math

import torch
from torch import nn

from scenelang.lifting.vector import PLANE_LAYOUT as LAYOUT
from scenelang.renderers.streaming import Streaming

SLOPE, WARP = 5.5, 0.9  # constants that keep entries of frames and strengths of warps positive
CARRIED = 18  # channels: 4 of coordinates, 4 slopes, 2 warps, 4 of the code, 3 colours and a one


@torch.no_grad()
def carry_frames(network: Streaming) -> None:
    """Let all deconvolutions carry frames, warps, codes and colours in their first `CARRIED` channels.

    Raises:
        ValueError: a level has fewer filters.
    """
    for level, layer in enumerate(network.deconvolutions):
        assert isinstance(layer, nn.ConvTranspose2d)
        assert layer.bias is not None
        if layer.out_channels < CARRIED:
            raise ValueError(f"{layer.out_channels} filters cannot carry {CARRIED} numbers")
        nn.init.normal_(layer.weight, std=0.7 * math.sqrt(0.5 / layer.in_channels))
        nn.init.zeros_(layer.bias)
        _carry(layer, 0.5**level, first=level == 0)


def _carry(layer: nn.ConvTranspose2d, half: float, *, first: bool) -> None:
    """Weights that hand the carried channels on from pixels whose half width is ``half`` world units."""
    w, bias = layer.weight, layer.bias
    assert bias is not None
    w[:, :CARRIED] = 0.0
    bias[:CARRIED] = 0.0
    bias[CARRIED - 1] = 1.0
    if first:
        bias[4:8], bias[8:10] = SLOPE, WARP
    for row in (0, 1):  # taps 1 and 2 of a kernel: the parent's upper or left child, its lower or right child
        for column in (0, 1):
            tap = w[:, :, 1 + row, 1 + column]
            x, y = (column - 0.5) * half, (0.5 - row) * half
            if first:
                _from_vector(tap, x, y)
            else:
                _from_parent(tap, x, y)


def _from_vector(tap: torch.Tensor, x: float, y: float) -> None:
    a, b, s, c, d, t = range(LAYOUT.places.frame.start, LAYOUT.places.frame.stop)
    for channel, entries in ((0, (a, b, s)), (2, (c, d, t))):
        for entry, times in zip(entries, (x, y, 1.0), strict=True):
            tap[entry, channel], tap[entry, channel + 1] = times, -times
    warp, colour = LAYOUT.places.inner.start, LAYOUT.places.rgb.start
    code = range(LAYOUT.places.code.stop)
    carried = (a, b, c, d, warp, warp + 1, *code, *(colour + 5 * k for k in range(3)))
    for channel, entry in enumerate(carried, 4):
        tap[entry, channel] = 1.0


def _from_parent(tap: torch.Tensor, x: float, y: float) -> None:
    for channel, slopes in ((0, 4), (2, 6)):
        for own, sign in ((channel, 1.0), (channel + 1, -1.0)):
            tap[channel, own], tap[channel + 1, own] = sign, -sign
            tap[slopes, own], tap[slopes + 1, own] = sign * x, sign * y
            tap[CARRIED - 1, own] = -sign * SLOPE * (x + y)
    for channel in range(4, CARRIED - 1):
        tap[channel, channel] = 1.0
