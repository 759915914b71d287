"""Answers for whole segments: how long rays from the light are in media, without a march.

A network has learned how long the half of a ray is in a leaf. It answers for rays that pass only media under
affine maps, joined by unions and beyond the reach of blends, whose balls are apart; the others are marched.
"""

from __future__ import annotations

from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.field import SolidField
from scenelang.renderers.solid.network import folded
from scenelang.renderers.solid.passes import BEGIN, END, INF, OBJECT, WAY, Passes


def known(solids: SolidField, passes: Passes) -> Array:
    """Which of M rays (M,) the network answers for."""
    xp, begin, end = solids.xp, passes.slots[BEGIN], passes.slots[END]
    objects = xp.whole(passes.slots[OBJECT]).clip(0)
    asked = xp.take(solids.asked, objects.reshape(-1)).reshape(objects.shape)
    # where the light is in a ball, both halves of the ray would have to be asked for
    held = (asked > 0) & (begin > 0) & (passes.slots[OBJECT] >= 0)
    fits = (held | (begin == INF)).sum(0) == len(begin)
    for slot in range(1, len(begin)):
        fits = fits & (((begin[slot] < end[:slot]) & (begin[:slot] < end[slot])).sum(0) == 0)
    return fits


def lengths(solids: SolidField, passes: Passes) -> tuple[Array, int]:
    """World units that rays (M,) are in media, and how many objects they were asked of.

    Args:
        solids: the field.
        passes: the balls of rays that are `known`.
    """
    xp, slots = solids.xp, passes.slots
    flat = xp.where((slots[BEGIN] < INF).reshape(-1))
    pairs = xp.take(slots.reshape(len(slots), -1), flat)
    objects, way, end = xp.whole(pairs[OBJECT]), pairs[WAY], pairs[END]
    speed = xp.sqrt((way * way).sum(0))
    q = xp.take(passes.origins, objects) + way * end
    found, which = 0 * end, xp.take(solids.decoder, objects)
    for i, layers in enumerate(solids.segments):
        some = xp.where(which == i)
        if len(some):
            x = folded(xp, xp.take(q, some), xp.take(way, some) / -xp.take(speed, some))
            xp.put(found, some, solids.network.field(x, layers, False)[0])
    found = xp.minimum(found.clip(0.0) / speed, end - pairs[BEGIN])
    each = 0 * slots[OBJECT].reshape(-1)
    xp.put(each, flat, found)
    return each.reshape(slots.shape[1:]).sum(0), len(flat)
