"""Textures of solids in pixels: four lookups where rays meet a surface, many along their ways in media."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from scenelang.graph.stage import EXTINCTION, Camera
from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.field import SolidField
from scenelang.renderers.solid.network import Wanted
from scenelang.renderers.solid.passes import Passes
from scenelang.renderers.solid.rays import Piece, Trail

INTO = 3e-5  # world units behind a surface where its material is asked for
EVEN = 2  # how much more evenly than the light that the medium takes nodes lie
BUSY = 8.0  # texels that a piece may cross with `FEW` panels of two points each
FEW, MANY = 4, 12
CHUNK = 1024  # pieces of which textures are looked up at once
PIXELS = 4096  # on surfaces, likewise
GRAZING = 0.5  # how much farther or nearer a pixel's samples may be on a surface, as a part of the way


class Lookups:
    """Asks a field for colours between the samples of pixels.

    The sides of pixels, px, are those of a picture that is 2 wide; 0 means one lookup.

    Args:
        field: the solids.
        camera: whose rays they are.
        nodes: points on a ray's way through a medium at which the light is asked for.
    """

    def __init__(self, field: SolidField, camera: Camera, nodes: int) -> None:
        self._field, self._xp, self._nodes = field, field.xp, nodes
        forward, right, up = np.asarray(camera.axes())
        four = [across * right + along * up for along in (0.25, -0.25) for across in (-0.25, 0.25)]
        self._eye, self._forward, self._four = (
            self._xp.array(np.asarray(value, np.float32), field.network.codes)
            for value in (
                camera.eye,
                forward * np.tan(camera.fov_rad / 2),
                np.transpose(four)[:, :, None],
            )
        )

    def mean(self, passes: Passes, way: Array, t: Array, n: Array, soft: bool, px: float) -> Array:
        """Mean colours (3, K) where the samples of pixels meet the planes through points at t with normals n.

        What a medium gives way to, if soft, has its own plane, and its own colours there.
        """
        xp, field = self._xp, self._field
        if len(t) > PIXELS:
            parts = [slice(at, at + PIXELS) for at in range(0, len(t), PIXELS)]
            some = [
                (Passes(passes.slots[:, :, at], passes.origins), way[:, at], t[at], n[:, at]) for at in parts
            ]
            return xp.concat([self.mean(*each, soft, px) for each in some], 1)
        seen, objects = way * t, None
        if soft:
            owner = field.meet(passes, t + INTO, Wanted.KIND, owners=True).owner
            objects = xp.whole(owner - 1).clip(0)
            n = field.normals(objects, self._eye[:, None] + seen)
        off = self._four * (px * t * (self._forward @ way))
        towards = (n * seen).sum(0)
        towards = xp.select(abs(towards) > 1e-6, towards, 0 * t - 1e-6)
        ratio = ((n[:, None] * off).sum(0) / towards).clip(-GRAZING, GRAZING)
        off = (off - seen[:, None] * ratio) / (1 + ratio)
        p = (self._eye[:, None] + way * (t + INTO))[:, None] + off
        if objects is not None:
            found = field.worn(xp.concat([objects] * 4, 0), p.reshape(3, -1))
        else:
            four = Passes(xp.concat([passes.slots] * 4, 2), passes.origins)
            found = field.colours(four, xp.concat([t + INTO] * 4, 0), p.reshape(3, -1))
        return found.reshape(3, 4, -1).mean(1)

    def along(self, way: Array, trail: Trail, pieces: Piece, px: float) -> Iterator[tuple[Array, int, Array]]:
        """Of pieces of rays in media with textures which they are, a node and what `_woven` gives for it.

        Args:
            way: of the rays (3, M).
            trail: what they met.
            pieces: their ways through media.
        """
        xp, (ray, begin, end, _) = self._xp, pieces
        if not self._field.textures:
            return
        texels = self._field.textured(trail.at(xp, ray)) * (end - begin).clip(0.0, 1 / EXTINCTION)
        for some, panels in (((texels > 0) & (texels <= BUSY), FEW), (texels > BUSY, MANY)):
            whole = xp.where(some)
            for start in range(0, len(whole), CHUNK):
                index = whole[start : start + CHUNK]
                part = tuple(xp.take(each, index) for each in pieces)
                for node, woven in enumerate(self._woven(way, trail, part, panels, px)):
                    yield index, node, woven

    def _woven(self, way: Array, trail: Trail, pieces: Piece, panels: int, px: float) -> list[Array]:
        """The colours (3, P) that nodes on pieces of rays have, times their weights, where colours vary.

        Between the nodes the light goes as the polynomial through them does. What this makes of a colour is
        summed up at many more points, which are in turn those of the pixel's samples.
        """
        xp, (ray, begin, end, before) = self._xp, pieces
        gauss, count = np.polynomial.legendre.leggauss, 2 * panels
        places = ((np.arange(panels)[:, None] + (gauss(2)[0] + 1) / 2) / panels).reshape(-1)
        nodes = (gauss(self._nodes)[0] + 1) / 2
        bases = [
            np.prod([(places - other) / (node - other) for other in nodes if other != node], 0)
            for node in nodes
        ]
        taken = 1 - xp.exp(-EXTINCTION / EVEN * (end - begin))
        left = 1 - xp.array(places[:, None].astype(np.float32), way) * taken
        t = (begin - xp.log(left) * (EVEN / EXTINCTION)).reshape(-1)  # of (places, P)
        weight = EVEN / count * taken * left ** (EVEN - 1) * xp.exp(-EXTINCTION * before)
        rays = xp.concat([ray] * count, 0)
        ways = xp.take(way, rays)
        p = self._eye[:, None] + ways * t
        if px:
            turns = np.resize((0, 1, 2, 3, 3, 2, 1, 0), count)
            four = xp.stack([self._four[:, i] for i in turns.tolist()], 1)  # (3, places, 1)
            p = p + (four * (px * t * (self._forward @ ways)).reshape(count, -1)).reshape(3, -1)
        colours = self._field.colours(trail.at(xp, rays), t, p).reshape(3, count, -1) * weight
        shares = [xp.array(base[:, None].astype(np.float32), way) for base in bases]
        return [(colours * share).sum(1) for share in shares]
