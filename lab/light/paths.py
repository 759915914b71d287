"""A path tracer: the light that comes along rays, to points of surfaces and of media, and to pixels.

Surfaces are found by sphere tracing and a root; ways through media are exact where their extinction is
constant between steps. Lamps are sampled by the solid angle that they fill, at glossy surfaces by reflected
directions as well (Veach's balance heuristic). Surfaces that glow are sampled by directions and by points
that lie evenly on them, one of a few by what it would send (resampled importance sampling: Talbot, Cline and
Egbert 2005). Where asked, points of all surfaces and media send what a few paths of their own brought them
(as Keller's instant radiosity, 1997, has it, with points that lie evenly). The first numbers of a path come
from Sobol' points that each pixel shifts by its own; independent shifts tell the standard error.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lab.light.field import DIFFUSE, GLOSSY, METAL, VOLUMETRIC, Array, World, colours, compiled, slope
from lab.light.rays import (
    DIMENSIONS,
    ENDS,
    GOLDEN,
    HITS,
    MEETS,
    MOST,
    ONE,
    STUCK,
    TWO,
    Room,
    draw,
    edge_of,
    end_of,
    march,
    probe,
    room_of,
    scrambled,
)
from lab.light.vectors import across, around, dot, frame, gains, plus, times, turned
from scenelang.compiler.spaces import FADE, LIFT, NEAREST, Stage
from scenelang.drawing.exact.solid import ways
from scenelang.drawing.image import encoded

SURELY = 4  # turns of a path before chance may end it
CHORDS, CANDIDATES = 20_000, 8  # of balls around what glows; of its points, of which one is asked
FEW, EACH, ASKS = 3_000, 8, 4  # where all send: chords or places; paths to each; points asked at first
CAPS = 0.98, 0.99  # of colours of surfaces and media
_INSIDE = 1e-6  # how far behind a surface its colour is asked for
_BEFORE = 1e-4  # where rays to it end, before it
EYE, RAY, SURFACE, MIDST = range(4)
ONES = 1.0, 1.0, 1.0
_TURN = 8  # numbers of a turn of a path


@compiled
def to_lamp(w: World, j: int, p: Any, u: float, v: float) -> Any:
    """Direction to a lamp, how far it is, how strong (1 / r² of a point), and its solid angle, 0 of none."""
    lamp = w.lamps[j]
    way = (lamp[0] - p[0], lamp[1] - p[1], lamp[2] - p[2])
    r, radius = math.sqrt(dot(way, way)), lamp[6]
    if radius == 0.0:
        r = max(r, 1e-300)
        return (way[0] / r, way[1] / r, way[2] / r), r, 1.0 / max(r, NEAREST) ** 2, 0.0
    if r <= radius:
        return (0.0, 1.0, 0.0), 0.0, 0.0, 0.0
    sine = (radius / r) ** 2
    cap = sine / (1.0 + math.sqrt(1.0 - sine))  # 1 - the cosine at the rim
    cos = 1.0 - u * cap
    sin2 = max(1.0 - cos * cos, 0.0)
    x, phi = math.sqrt(sin2), 2 * math.pi * v
    d = turned((way[0] / r, way[1] / r, way[2] / r), x * math.cos(phi), x * math.sin(phi), cos)
    far = r * cos - math.sqrt(max(radius * radius - r * r * sin2, 0.0))
    return d, far, 2.0 * cap / radius**2, 2.0 * math.pi * cap


@compiled
def reflect(kind: int, rgb: Any, alpha: float, n: Any, v: Any, way: Any, f: Array) -> Any:
    """Write what a surface reflects from ``way`` to ``v``, times the cosine; the odds of ``way``."""
    nv, nl = max(dot(n, v), 1e-6), dot(n, way)
    if nl <= 0.0:
        f[:] = 0.0
        return 0.0
    if kind == DIFFUSE:
        for c in range(3):
            f[c] = rgb[c] * nl / math.pi
        return nl / math.pi
    h = (v[0] + way[0], v[1] + way[1], v[2] + way[2])
    size = max(math.sqrt(dot(h, h)), 1e-300)
    nh, hv = dot(n, h) / size, dot(v, h) / size
    a2 = alpha * alpha
    density = a2 / (math.pi * (nh * nh * (a2 - 1.0) + 1.0) ** 2)
    mask_v = 2.0 * nv / (nv + math.sqrt(a2 + (1.0 - a2) * nv * nv))
    mask_l = 2.0 * nl / (nl + math.sqrt(a2 + (1.0 - a2) * nl * nl))
    lobe = density * mask_v * mask_l / (4.0 * nv)
    odds = density * mask_v / (4.0 * nv)
    grazing = max(1.0 - hv, 0.0) ** 5
    if kind == METAL:
        for c in range(3):
            f[c] = (rgb[c] + (1.0 - rgb[c]) * grazing) * lobe
        return odds
    base = (1.0 - 0.04 - 0.96 * (1.0 - nv) ** 5) * nl / math.pi
    for c in range(3):
        f[c] = (0.04 + 0.96 * grazing) * lobe + base * rgb[c]
    return 0.5 * odds + 0.5 * nl / math.pi


@compiled
def mirrored(n: Any, v: Any, alpha: float, u: float, w: float) -> Any:
    """A direction by the visible normals of GGX (Heitz 2018)."""
    t, b = frame(n)
    x, y, z = dot(t, v), dot(b, v), max(dot(n, v), 1e-6)
    hx, hy, hz = alpha * x, alpha * y, z
    size = math.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx / size, hy / size, hz / size
    flat = math.sqrt(hx * hx + hy * hy)
    px, py = (-hy / flat, hx / flat) if flat > 1e-9 else (1.0, 0.0)
    qx, qy, qz = -hz * py, hz * px, hx * py - hy * px
    radius, phi = math.sqrt(u), 2 * math.pi * w
    a, c = radius * math.cos(phi), radius * math.sin(phi)
    c = (1.0 - (1.0 + hz) / 2) * math.sqrt(max(1.0 - a * a, 0.0)) + (1.0 + hz) / 2 * c
    e = math.sqrt(max(1.0 - a * a - c * c, 0.0))
    mx, my = alpha * (a * px + c * qx + e * hx), alpha * (a * py + c * qy + e * hy)
    mz = max(c * qz + e * hz, 0.0)
    size = max(math.sqrt(mx * mx + my * my + mz * mz), 1e-300)
    mx, my, mz = mx / size, my / size, mz / size
    k = 2.0 * (x * mx + y * my + z * mz)
    return turned(n, k * mx - x, k * my - y, k * mz - z)


@compiled
def lamps_at(
    w: World, p: Any, n: Any, v: Any, kind: int, alpha: float, rgb: Any, room: Room, dim: int
) -> Any:
    """Light (3,) that lamps send by way of a point: at the eye's from all, else from one by chance."""
    count = len(w.lamps)
    out = (0.0, 0.0, 0.0)
    if count == 0:
        return out
    u, x, pick = draw(room, dim), draw(room, dim + 1), draw(room, dim + 2)
    total = 0.0
    if dim >= _TURN and count > 1:
        for j in range(count):
            total += _guess(w, j, p)
        pick *= total
    for j in range(count):
        share = 1.0
        if total > 0.0:
            guess = _guess(w, j, p)
            share, pick = guess / total, pick - guess
            if pick >= 0.0 and j < count - 1:
                continue
        u1, x1 = (u + j * 0.7548776662466927) % 1.0, (x + j * 0.5698402909980532) % 1.0
        d, far, strength, angle = to_lamp(w, j, p, u1, x1)
        weight = math.pi * strength / share
        if kind == VOLUMETRIC:
            for c in range(3):
                room.f[c] = rgb[c] / (4.0 * math.pi)
            if w.lamps[j, 7] > 0.0 and room.ray[8] > 0.0:
                weight *= room.ray[8] / (room.ray[8] + beside(w, j, room.ray, p)[1])
        else:
            odds = reflect(kind, rgb, alpha, n, v, d, room.f)
            if kind != DIFFUSE and angle > 0.0:
                weight /= 1.0 + odds * angle
        f = room.f[0], room.f[1], room.f[2]
        if weight * max(f[0], max(f[1], f[2])) > 0.0:
            _, ending, tau = march(w.field, p, d, far, np.inf, False, room)
            if ending == ENDS:
                weight *= math.exp(-tau)
                lamp = w.lamps[j]
                out = plus(out, weight, (f[0] * lamp[3], f[1] * lamp[4], f[2] * lamp[5]))
        if total > 0.0:
            break
    return out


@compiled
def beside(w: World, j: int, ray: Array, p: Any) -> Any:
    """Where the angle at a lamp begins and how far it goes along a ray, the odds of a point of it, and the
    foot and length of the perpendicular (Kulla and Fajardo 2012).
    """
    o, d = (ray[0], ray[1], ray[2]), (ray[3], ray[4], ray[5])
    way = (w.lamps[j, 0] - o[0], w.lamps[j, 1] - o[1], w.lamps[j, 2] - o[2])
    foot = dot(way, d)
    off = max(math.sqrt(max(dot(way, way) - foot * foot, 0.0)), 1e-5)
    low, high = math.atan((ray[6] - foot) / off), math.atan((ray[7] - foot) / off)
    t = dot((p[0] - o[0], p[1] - o[1], p[2] - o[2]), d) - foot
    return low, off / ((high - low) * (off * off + t * t)), high - low, foot, off


@compiled
def by_direction(w: World, who: int, p: Any, t: float, facing: float, odds: float) -> Any:
    """The share of what a point sends to one t away that counts where a direction of these odds meets it, not
    where it is chosen among points; ``facing`` is its cosine, or the extinction of a medium.
    """
    if odds <= 0.0 or w.shares[who] <= 0.0:
        return 1.0
    ball = w.glowing[who]
    off = (p[0] - ball[0], p[1] - ball[1], p[2] - ball[2])
    if dot(off, off) >= ball[3] * ball[3]:
        return 1.0
    return odds / (odds + CANDIDATES * w.shares[who] * t * t / max(facing, 1e-9))


@compiled
def passing(w: World, o: Any, d: Any, odds: float, cap: float, room: Room) -> Any:
    """Light (3,) that media along a ray scatter of lamps in or near them, by points chosen by the angle."""
    ray, out = room.ray, (0.0, 0.0, 0.0)
    ray[0], ray[1], ray[2], ray[3], ray[4], ray[5] = o[0], o[1], o[2], d[0], d[1], d[2]
    ray[6], ray[7], ray[8] = np.inf, 0.0, 0.0
    for i in range(len(room.d)):
        if w.field.rows[i, 34] > 0.0 and room.spans[1, i] > 0.0:
            ray[6], ray[7] = min(ray[6], max(room.spans[0, i], 0.0)), max(ray[7], room.spans[1, i])
    for j in range(len(w.lamps)):
        if w.lamps[j, 7] == 0.0 or ray[7] <= ray[6]:
            continue
        low, _, wide, foot, off = beside(w, j, ray, o)
        t = foot + off * math.tan(low + wide * draw(room, DIMENSIONS))
        t = min(max(t, ray[6]), ray[7])
        p = plus(o, t, d)
        who = colours(w, p[0], p[1], p[2], room.d, room.stack, room.look)
        sigma = w.field.rows[who, 34]
        if room.stack[0, 0] >= 0.0 or sigma == 0.0:
            continue
        rgb = (min(room.look[0], cap), min(room.look[1], cap), min(room.look[2], cap))
        way, far, strength, _ = to_lamp(w, j, p, draw(room, DIMENSIONS), draw(room, DIMENSIONS))
        if strength == 0.0:
            continue
        _, ending, before = march(w.field, o, d, t, np.inf, False, room)
        if ending != ENDS:
            continue
        _, ending, after = march(w.field, p, way, far, np.inf, False, room)
        if ending == ENDS:
            meets = sigma * math.exp(-before)
            share = meets * math.exp(-after) * strength / 4.0 / (meets + beside(w, j, ray, p)[1])
            share *= by_direction(w, who, p, t, sigma, odds)
            lamp = w.lamps[j]
            out = plus(out, share, (rgb[0] * lamp[3], rgb[1] * lamp[4], rgb[2] * lamp[5]))
    return out


@compiled
def _guess(w: World, j: int, p: Any) -> Any:
    """About how much light a lamp sends to a point."""
    lamp = w.lamps[j]
    way = (lamp[0] - p[0], lamp[1] - p[1], lamp[2] - p[2])
    return max(lamp[3], lamp[4], lamp[5]) / max(dot(way, way), 0.01 + lamp[6] * lamp[6])


@compiled
def follow(w: World, o: Any, d: Any, eye: bool, known: float, how: int, room: Room, dim: int) -> None:
    """Write the light and alpha (4,) that come along a ray; ``known`` is how far it goes, or -1."""
    light, through = room.light, (1.0, 1.0, 1.0)
    light[:] = 0.0
    odds, tau, coated = -1.0, 0.0, False  # odds of the direction, and whether lamps are met by it too
    for turn in range(MOST):
        end = end_of(w, o, d)
        t, ending = known, how
        if t < 0.0:
            target = -math.log(1.0 - draw(room, dim)) if w.media else np.inf
            t, ending, tau = march(w.field, o, d, end, target, True, room)
        known = -1.0
        if w.media and ending != STUCK and len(w.lamps) and w.lamps[:, 7].any():
            sent = passing(w, o, d, odds if w.all_send else -1.0, CAPS[1], room)
            gains(light, through, 1.0, sent)
        if coated:
            for j in range(len(w.lamps)):
                lamp = w.lamps[j]
                way = (lamp[0] - o[0], lamp[1] - o[1], lamp[2] - o[2])
                along, far = dot(way, d), dot(way, way)
                root = along * along - far + lamp[6] ** 2
                ahead = lamp[6] > 0.0 and along > 0.0 and root > 0.0 and far > lamp[6] ** 2
                if ahead and along - math.sqrt(root) < t:
                    sine = lamp[6] ** 2 / far
                    angle = 2 * math.pi * sine / (1.0 + math.sqrt(1.0 - sine))
                    weight = odds * angle / (1.0 + odds * angle) / lamp[6] ** 2
                    gains(light, through, weight, lamp[3:6])
        if ending == STUCK:
            break
        p = plus(o, t, d)
        sky = w.seen if eye else w.sky
        if ending == ENDS and end == np.inf:
            up = min(max(d[1] / 0.5, 0.0), 1.0)
            for c in range(3):
                light[c] += through[c] * (sky[c] + (sky[3 + c] - sky[c]) * up) * (w.seen[6] if eye else 1.0)
            light[3] = max(light[3], w.seen[6])
            break
        light[3] = 1.0
        kind, alpha, n, lift, share = DIFFUSE, 0.0, (0.0, 1.0, 0.0), LIFT, 1.0
        if ending == ENDS:
            clear = math.exp(-(p[0] * p[0] + p[2] * p[2]) / (FADE * FADE))
            gains(light, through, 1.0 - clear, sky)
            through = times(through, clear, ONES)
            rgb, cap = (w.ground[1], w.ground[2], w.ground[3]), CAPS[0]
        else:
            q = _INSIDE if ending == HITS else 0.0
            look = room.look
            x, y, z = plus(p, q, d)
            who = colours(w, x, y, z, room.d, room.stack, look)
            rgb, kind, cap = (look[0], look[1], look[2]), int(w.field.rows[who, 33]), CAPS[0]
            glow = (look[3], look[4], look[5])
            if ending == MEETS:
                gains(light, through, 1.0, glow)
                kind, cap, lift = VOLUMETRIC, CAPS[1], 0.0
                room.ray[8] = w.field.rows[who, 34] * math.exp(-tau)
                if w.all_send:
                    share = by_direction(w, who, p, t, w.field.rows[who, 34], odds)
            else:
                alpha = w.look[who, 6] ** 2
                n = slope(w.field, who, p[0], p[1], p[2], room.d, room.stack)
                if dot(n, d) > 0.0:
                    n = (-n[0], -n[1], -n[2])
                share = by_direction(w, who, p, t, -dot(n, d), odds)
                if w.media and share < 1.0:  # points lie on what borders on nothing
                    x, y, z = plus(p, -_INSIDE, d)
                    colours(w, x, y, z, room.d, room.stack, look)
                    share = share if room.stack[0, 0] >= 0.0 else 1.0
                gains(light, through, share, glow)
                if kind != DIFFUSE or not w.all_send:
                    share = 1.0
        rgb = (min(rgb[0], cap), min(rgb[1], cap), min(rgb[2], cap))
        through = times(through, share, ONES)
        o = plus(p, lift, n)
        v = (-d[0], -d[1], -d[2])
        sent = lamps_at(w, o, n, v, kind, alpha, rgb, room, dim + 1)
        gains(light, through, 1.0, sent)
        asks = ASKS if w.all_send and turn == 0 else 1
        for _ in range(asks if len(w.shining) else 0):
            sent = glows_at(w, o, n, v, kind, alpha, rgb, room)
            gains(light, through, 1.0 / asks, sent)
        d, odds, ratio = onward(w, n, v, kind, alpha, rgb, room, dim + 4)
        coated = kind in (GLOSSY, METAL)
        through = times(through, 1.0, ratio)
        most = max(through[0], max(through[1], through[2]))
        if turn >= SURELY:
            keep = min(most, 0.99)
            if draw(room, dim + 7) >= keep:
                break
            through = times(through, 1.0 / keep, ONES)
        if most <= 0.0:
            break
        eye = False
        dim += _TURN


@compiled
def onward(w: World, n: Any, v: Any, kind: int, alpha: float, rgb: Any, room: Room, dim: int) -> Any:
    """A path's next direction, its odds, and its weight (3,)."""
    a, b, pick = draw(room, dim), draw(room, dim + 1), draw(room, dim + 2)
    if kind == VOLUMETRIC:
        return around(a, b), 1.0 / (4.0 * math.pi), rgb
    if kind == METAL or (kind == GLOSSY and pick < 0.5):
        d = mirrored(n, v, alpha, a, b)
    else:
        d = across(n, a, b)
    if kind == DIFFUSE:
        return d, max(dot(n, d), 0.0) / math.pi, rgb
    f = room.f
    odds = reflect(kind, rgb, alpha, n, v, d, f)
    if max(f[0], max(f[1], f[2])) <= 0.0:
        return d, 1.0, (0.0, 0.0, 0.0)
    return d, odds, (f[0] / odds, f[1] / odds, f[2] / odds)


@compiled
def _shining(which: int, points: Array, w: World, room: Room, o: Array, d: Array) -> int:
    """Write points of an object that glows, or if all send of one that is diffuse, where chords (K, 3) as
    long as their directions meet it; return how many.
    """
    first, last = 0, len(points)
    for i in range(len(o)):
        way = math.sqrt(d[i, 0] ** 2 + d[i, 1] ** 2 + d[i, 2] ** 2)
        start, to = (o[i, 0], o[i, 1], o[i, 2]), (d[i, 0] / way, d[i, 1] / way, d[i, 2] / way)
        march(w.field, start, to, way, 0.0, False, room)  # for its spans
        t = 0.0
        value, kind, _, ahead = probe(w.field, start, to, t, room)
        while t < way and first < last:
            now = min(t + ahead, way)
            value1, kind1, _, ahead = probe(w.field, start, to, now, room)
            if (value < 0.0) != (value1 < 0.0):
                edge = edge_of(w.field, start, to, t, value, kind, now, value1, True, room)
                x, y, z = plus(start, edge + (_INSIDE if value1 < 0.0 else -_INSIDE), to)
                who = colours(w, x, y, z, room.d, room.stack, room.look)
                if who == which and (w.all_send or max(room.look[3], max(room.look[4], room.look[5])) > 0.0):
                    points[first, 6:9], points[first, 11:14] = room.look[3:6], room.look[:3]
                    x, y, z = plus(start, edge, to)
                    points[first, 0], points[first, 1], points[first, 2] = x, y, z
                    n = slope(w.field, who, x, y, z, room.d, room.stack)
                    points[first, 3], points[first, 4], points[first, 5] = n
                    points[first, 10] = 1.0
                    first += 1
            t, value, kind = now, value1, kind1
    return first


@compiled
def _midst(which: int, points: Array, w: World, room: Room, p: Array) -> int:
    """Write those of places (K, 3) that lie in an object's medium; return how many."""
    count = 0
    for i in range(len(p)):
        who = colours(w, p[i, 0], p[i, 1], p[i, 2], room.d, room.stack, room.look)
        if who == which and room.stack[0, 0] < 0.0:
            points[count, :3], points[count, 11:14] = p[i], room.look[:3]
            points[count, 10] = w.field.rows[who, 34]
            count += 1
    return count


def shining_of(w: World, seed: int) -> World:
    """The world with points of what glows, or of all if ``all_send``, which lie evenly by area or volume."""
    rng, room, count = np.random.default_rng([seed, 7]), room_of(w, np.zeros((1, DIMENSIONS))), CHORDS
    if w.all_send:
        count = FEW
    found, shares = [np.zeros((0, 14))], np.zeros(len(w.glowing))
    for i, (*centre, radius) in enumerate(w.glowing):
        if radius:
            points = np.zeros((8 * count, 14))
            if w.field.rows[i, 34]:
                ways = rng.normal(size=(count, 3))
                ways *= np.cbrt(rng.random((count, 1))) / np.linalg.norm(ways, axis=1)[:, None]
                last = _midst(i, points, w, room, centre + radius * ways)
                shares[i] = count / (4.0 / 3.0 * math.pi * radius**3)
            else:
                way, off = rng.normal(size=(2, count, 3))
                way /= np.linalg.norm(way, axis=1)[:, None]
                off = np.cross(way, off)
                r = np.sqrt(rng.random(count))[:, None]
                half = np.sqrt(1.0 - r * r)
                start = centre + radius * (r * off / np.linalg.norm(off, axis=1)[:, None] - half * way)
                last = _shining(i, points, w, room, start, 2.0 * half * radius * way)
                # a chord meets an area A in the ball 2 A / (4 pi radius^2) times
                shares[i] = count / (2.0 * math.pi * radius**2)
            points[:last, 9] = shares[i]
            found.append(points[:last])
    points, most = np.concatenate(found), max(sum(map(len, found)), 1)
    points[:, 9] /= most
    return w._replace(shining=points, shares=shares / most)


def all_sending(w: World, seed: int, threads: int) -> World:
    """The world with points of all that is diffuse or a medium, which send what they glow and scatter."""
    if not w.bounds[:, 3].any():
        return w
    out = shining_of(w._replace(glowing=w.bounds, all_send=True), seed)
    rows = out.shining
    solid = rows[:, 3:6].any(1)
    how: dict[str, Any] = {"seed": seed + 1, "threads": threads}
    if solid.any():
        came = irradiance(w, rows[solid, :3], rows[solid, 3:6], EACH, **how)
        rows[solid, 6:9] += np.minimum(rows[solid, 11:14], CAPS[0]) * came
    if not solid.all():
        came = fluence(w, rows[~solid, :3], EACH, **how)
        rows[~solid, 6:9] = rows[~solid, 10:11] * np.minimum(rows[~solid, 11:14], CAPS[1]) * came
    return out


@compiled
def glows_at(w: World, p: Any, n: Any, v: Any, kind: int, alpha: float, rgb: Any, room: Room) -> Any:
    """Light (3,) that what glows sends by way of a point, by one point of it."""
    count = len(w.shining)
    out = (0.0, 0.0, 0.0)
    total, chosen = 0.0, 0.0
    for _ in range(CANDIDATES):
        row = w.shining[int(draw(room, DIMENSIONS) * count)]
        way = (row[0] - p[0], row[1] - p[1], row[2] - p[2])
        square = max(dot(way, way), 1e-12)
        far = math.sqrt(square)
        d = (way[0] / far, way[1] / far, way[2] / far)
        facing = -dot((row[3], row[4], row[5]), d)
        if row[3] == 0.0 and row[4] == 0.0 and row[5] == 0.0:
            facing = 1.0  # a medium's
        if facing <= 0.0:
            continue
        if kind == VOLUMETRIC:
            odds = 1.0 / (4.0 * math.pi)
            room.f[0], room.f[1], room.f[2] = rgb[0] * odds, rgb[1] * odds, rgb[2] * odds
        else:
            odds = reflect(kind, rgb, alpha, n, v, d, room.f)
        if odds <= 0.0:
            continue
        likely = CANDIDATES * row[9] * square / (facing * row[10])
        weight = facing / square / row[9] * likely / (likely + odds)
        sent = (room.f[0] * row[6], room.f[1] * row[7], room.f[2] * row[8])
        size = weight * max(sent[0], max(sent[1], sent[2]))
        total += size
        if size > 0.0 and draw(room, DIMENSIONS) * total < size:
            chosen = size
            out = (weight * sent[0], weight * sent[1], weight * sent[2])
            room.aim[0], room.aim[1], room.aim[2], room.aim[3] = d[0], d[1], d[2], far
    if chosen == 0.0:
        return out
    d, far = (room.aim[0], room.aim[1], room.aim[2]), room.aim[3]
    _, ending, tau = march(w.field, p, d, far - _BEFORE, np.inf, False, room)
    if ending != ENDS:
        return 0.0, 0.0, 0.0
    weight = total / chosen / CANDIDATES * math.exp(-tau)
    return out[0] * weight, out[1] * weight, out[2] * weight


@compiled
def traced(
    w: World, o: Array, d: Array, mode: int, lamps: bool, block: int, first: int, seed: Any, count: int,
    room: Room, out: Array,
) -> None:  # fmt: skip
    """Write the mean light (M, 4) of ``count`` paths for each of M rays or points; see `light`."""
    up = (0.0, 1.0, 0.0)
    for m in range(len(o)):
        own = scrambled(seed + np.uint64((first + m) // block) * GOLDEN)
        room.chance[1] = scrambled(own + ONE)
        room.chance[0] = scrambled(own + np.uint64((first + m) % block) * TWO)
        p, n = (o[m, 0], o[m, 1], o[m, 2]), (d[m, 0], d[m, 1], d[m, 2])
        known, how, paths = -1.0, 0, count
        out[m] = 0.0
        if mode == EYE and not w.media:
            known, how, _ = march(w.field, p, n, end_of(w, p, n), np.inf, True, room)
            if how == ENDS and known == np.inf:
                paths = 1
        for i in range(paths):
            room.chance[2] = np.uint64((first + m) % block * count + i)
            base, way, start = 0, n, p
            if mode >= SURFACE:
                a, b = draw(room, 4), draw(room, 5)
                base = _TURN
                way = around(a, b) if mode == MIDST else across(n, a, b)
                if mode == SURFACE:
                    start = plus(p, LIFT, n)
                if lamps:
                    room.ray[8], kind = 0.0, VOLUMETRIC if mode == MIDST else DIFFUSE
                    sent = lamps_at(w, start, n, up, kind, 0.0, ONES, room, 1)
                    for c in range(3):
                        out[m, c] += sent[c]
            follow(w, start, way, mode == EYE, known, how, room, base)
            for c in range(4):
                out[m, c] += room.light[c]
        for c in range(4):
            out[m, c] /= paths


def light(
    w: World,
    origins: npt.ArrayLike,
    directions: npt.ArrayLike,
    paths: int,
    *,
    mode: int = RAY,
    lamps: bool = True,
    block: int = 1,
    seed: int = 0,
    threads: int = 2,
) -> Array:
    """Trace light to rays or points.

    Args:
        w: a scene.
        origins, directions: (M, 3), the latter of length 1.
        paths: of each ray, a power of two.
        mode: `EYE` or `RAY` for radiance along rays; `SURFACE` for (1/π) ∫ L cos θ dω about normals, which
            directions are then; `MIDST` for (1/4π) ∫ L dω.
        lamps: with the lamps' own light, in the last two.
        block: as many rays in order share their Sobol' points, as the samples of a pixel do.

    Returns:
        Linear light and alpha (M, 4).
    """
    from scipy.stats.qmc import Sobol

    o, d = (np.ascontiguousarray(v, np.float64) for v in (origins, directions))
    count = block * paths
    table = np.asarray(Sobol(DIMENSIONS, scramble=False).random(count))
    out = np.empty((len(o), 4))
    size = max(block, -(-min(4096, -(-len(o) // (8 * threads))) // block) * block)
    if w.glowing[:, 3].any() and not w.all_send:
        w = shining_of(w, seed)
    key = np.uint64(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])

    def part(first: int) -> None:
        rows = slice(first, first + size)
        traced(w, o[rows], d[rows], mode, lamps, block, first, key, paths, room_of(w, table), out[rows])

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(part, range(0, len(o), size)))
    return out


def irradiance(w: World, points: Array, normals: Array, paths: int, **how: Any) -> Array:
    """(1/π) ∫ L cos θ dω (M, 3) over the hemispheres of surface points (M, 3); options as of `light`."""
    return light(w, points, normals, paths, mode=SURFACE, **how)[:, :3]


def fluence(w: World, points: Array, paths: int, **how: Any) -> Array:
    """(1/4π) ∫ L dω (M, 3) over the sphere at points (M, 3); options as of `light`."""
    return light(w, points, np.zeros_like(points), paths, mode=MIDST, **how)[:, :3]


class Traced(NamedTuple):
    """Linear light and alpha (4, H, W), and the standard error of the mean, the like."""

    mean: Array
    error: Array
    paths: int  # of a pixel

    @property
    def decibels(self) -> float:
        """PSNR of the encoded picture to what more paths would give, as far as the standard error tells."""
        high, low = encoded(self.mean[:3] + self.error[:3]), encoded(self.mean[:3] - self.error[:3])
        return float(-10.0 * np.log10(np.mean(((high - low) / 2.0) ** 2) + 1e-12))


def traced_picture(
    w: World,
    stage: Stage,
    canvas: tuple[int, int],
    *,
    per_side: int = 2,
    paths: int = 64,
    batch: int = 64,
    enough: float = np.inf,
    known: Traced | None = None,
    points: bool = False,
    seed: int = 0,
    threads: int = 2,
) -> Traced:
    """Trace a picture.

    Args:
        w: the scene's tables; ``stage`` has its camera.
        canvas: width and height in pixels.
        per_side: samples of a pixel along each side.
        paths: of a pixel at most, in batches of a power of two for each sample, two at least.
        enough: decibels of `Traced` after which no batch begins.
        known: the same picture of fewer paths, in batches of the same size, to go on from.
        points: whether points of all surfaces and media send to paths, found anew for each batch.
    """
    width, height = canvas
    d = ways(stage, canvas, range(height), per_side)
    d = d.reshape(3, height, per_side, width, per_side).transpose(1, 3, 2, 4, 0).reshape(-1, 3)
    o = np.broadcast_to(np.asarray(stage.camera.eye), d.shape)
    block = per_side**2
    each = 1 << max(0, round(math.log2(max(batch / block, 1))))
    total, square = np.zeros((2, 4, height, width))
    begun = known.paths // (each * block) if known is not None else 0
    traced = known
    if known is not None:
        total = known.mean * begun
        square = begun * (known.error**2 * (begun - 1) + known.mean**2)
    for done in range(begun + 1, max(paths // (each * block), 2) + 1):
        key = seed * 65_537 + done
        world = all_sending(w, key, threads) if points else w
        found = light(world, o, d, each, mode=EYE, block=block, seed=key, threads=threads)
        value = found.reshape(height, width, block, 4).mean(2).transpose(2, 0, 1)
        total, square = total + value, square + value**2
        spread = np.maximum(square / done - (total / done) ** 2, 0.0) / max(done - 1, 1)
        traced = Traced(total / done, np.sqrt(spread), each * block * done)
        if done > 1 and traced.decibels >= enough:
            break
    assert traced is not None
    return traced
