"""What pixels show besides outlines: textures, looked up when all objects are met, and lines in blends."""

from __future__ import annotations

import numpy as np

from scenelang.program.groups import SMOOTH, UNION
from scenelang.renderers.arrays import Array
from scenelang.renderers.field import NO_TEXTURE, Field, Trace
from scenelang.renderers.meetings import Meetings

QUARTER = np.array([[-0.25, 0.25, -0.25, 0.25], [-0.25, -0.25, 0.25, 0.25]], np.float32)
"""Where the samples of a pixel lie (2, 4), pixels from its centre."""
CORNER = 0.36  # pixels from the centre to a sample, a little rounded up
NARROW = 1 / 16  # of a pixel by the width of a blend: above it colours change much across the pixel
LEAST = 1e-4  # of a colour, that counts as part of what a point shows


def blending(field: Field, meetings: Meetings, trace: Trace, px: float) -> Array:
    """Which pixels (groups, B), of a side, may have samples in a narrow blend with a texture."""
    xp, objects, place = field.xp, meetings.pairs.object, meetings.places()
    found = 0.0 * trace.paint[:, : len(meetings.columns)] > 0
    worn = np.zeros(len(meetings.columns), bool)
    worn[place[field.texture[objects] != NO_TEXTURE]] = True
    width = field.widths[objects]
    narrow = (field.tokens[objects] == SMOOTH) & (px > NARROW * width) & ~meetings.pairs.open & worn[place]
    gap = xp.array((width + CORNER * px * (1 + field.frames.stretch[objects])).astype(np.float32), field.like)
    for part in meetings.slots():
        if narrow[part].any():
            some = found[:, : part.stop - part.start]
            some |= (abs(trace.margin[:, part]) < gap[part]) & xp.array(narrow[part], field.like)
    if trace.joined and worn.any():
        most = CORNER * px * (1 + float(field.frames.stretch.max()))
        for (columns, groups, _), _, margin, _ in trace.joined:
            width = field.group_widths[groups]
            narrow = (field.groups.joins[groups] == SMOOTH) & (px > NARROW * width) & worn[columns]
            near = abs(margin) < xp.array((width + most).astype(np.float32), field.like)
            found[:, columns] |= near & xp.array(narrow, field.like)
    return found


def ties(field: Field, meetings: Meetings, trace: Trace, px: float) -> Array:
    """Which pixels (groups, B), of a side, may see where one object's colour gives way to another's.

    In a union, outside both of them, that is not an outline, but a later blend may show it.
    """
    xp, token = field.xp, field.tokens[meetings.pairs.object]
    joins, blends = (xp.array(token == kind, field.like) for kind in (UNION, SMOOTH))
    tied, shown = (0.0 * trace.paint[:, : len(meetings.columns)] > 0 for _ in range(2))
    for part in meetings.slots():
        n, paint = part.stop - part.start, trace.paint[:, part]
        shown[:, :n] |= tied[:, :n] & blends[part] & (paint > LEAST) & (paint < 1 - LEAST)
        tied[:, :n] |= joins[part] & (abs(trace.margin[:, part]) < 2 * CORNER * px)
    if not trace.joined:
        return shown
    blended = 0.0 * tied > 0
    for part in meetings.slots():
        n, paint = part.stop - part.start, trace.paint[:, part]
        blended[:, :n] |= blends[part] & (paint > LEAST) & (paint < 1 - LEAST)
    for (columns, groups, _), paint, margin, _ in trace.joined:
        joins, blends = (xp.array(field.groups.joins[groups] == kind, field.like) for kind in (UNION, SMOOTH))
        blended[:, columns] |= blends & (paint > LEAST) & (paint < 1 - LEAST)
        tied[:, columns] |= joins & (abs(margin) < 2 * CORNER * px)
    return shown | (tied & blended)


def add_textures(
    field: Field, meetings: Meetings, trace: Trace, p: Array, memory: Array, seen: Array, px: float
) -> None:
    """Add the textures that points show to their colours.

    Args:
        p: the points (2, groups, B).
        memory: state and register (groups, S + 3, B).
        seen: (groups, B) of which points.
        px: side of the pixels for which textures are looked up four times, world units; 0: once.
    """
    xp, objects, place = field.xp, meetings.pairs.object, meetings.places()
    shares = trace.shares(meetings, field.nesting(meetings), seen)
    groups, columns = seen.shape
    offsets = xp.array(QUARTER * np.float32(px), p)[:, :, None] if px else None
    total = xp.full((3, groups * columns), 0.0, p)
    texture = field.texture[objects]
    for number in np.unique(texture[texture != NO_TEXTURE]).tolist():
        pairs = np.flatnonzero(texture == number)
        share = xp.take(shares, xp.array(pairs, p)).reshape(-1)
        some = xp.where(share > LEAST)
        if not len(some):
            continue
        group, pair = np.divmod(xp.to_numpy(some), len(pairs))
        pair = pairs[pair]
        index = xp.array(group * columns + place[pair], p)
        spots = xp.take(p.reshape(2, -1), index)
        if offsets is not None:
            spots = spots[:, None] + offsets
        q = field.frames.local(xp, objects[pair], spots)
        found = field.textures[number].at(q.reshape(2, -1)).reshape(3, -1, len(pair))
        xp.add(total, index, found.mean(1) * xp.take(share, some))
    s = field.network.config.state
    memory[:, s : s + 3] += total.reshape(3, groups, columns).swapaxes(0, 1)
