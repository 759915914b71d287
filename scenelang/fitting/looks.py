"""Colours of meshes: at corners of triangles, or by texture.

Colours are what files mean, as numbers of sRGB. What glTF writes of colours is linear, its textures aside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.image import decoded, encoded

MOST_PIXELS: Final = 1 << 26
FINEST: Final = 2048  # pixels along a side of a texture; finer ones are made smaller
Points = npt.NDArray[np.float64]  # (M, 3)
Rows = npt.NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """The colours of F triangles.

    Args:
        tint: (F, 3, 3): at corners; of a texture what multiplies it.
        linear: whether tints are linear.
        uv: (F, 3, 2): at corners, v up.
        image: (F,) which texture, -1 for none.
        images: textures (h, w, 3), 0 to 255.
    """

    tint: npt.NDArray[np.float32]
    linear: npt.NDArray[np.bool_]
    uv: npt.NDArray[np.float32]
    image: npt.NDArray[np.int32]
    images: tuple[npt.NDArray[np.uint8], ...] = ()

    def of(self, chosen: Rows) -> Look:
        """The look of some of the triangles."""
        return Look(self.tint[chosen], self.linear[chosen], self.uv[chosen], self.image[chosen], self.images)

    def at(self, triangles: Rows, share: Points) -> Points:
        """Colours (M, 3) of sRGB, 0 to 1, at points of triangles (M,), by barycentric shares (M, 3)."""
        found = (self.tint[triangles] * share[..., None]).sum(1)
        linear = self.linear[triangles]
        texel = np.ones_like(found)
        uv = (self.uv[triangles] * share[..., None]).sum(1)
        for k, image in enumerate(self.images):
            on = self.image[triangles] == k
            texel[on] = _looked_up(image, uv[on])
        found[linear] = encoded(found[linear] * decoded(texel[linear]))
        found[~linear] *= texel[~linear]
        return np.asarray(found.clip(0, 1))

    @property
    def plain(self) -> tuple[float, float, float] | None:
        """The one colour of all, if it is one."""
        first = self.tint[:1, :1]
        if (self.image >= 0).any() or (abs(self.tint - first) > 1 / 512).any() or len(set(self.linear)) > 1:
            return None
        r, g, b = self.at(np.zeros(1, int), np.full((1, 3), 1 / 3))[0].round(4).tolist()
        return r, g, b


def _looked_up(image: npt.NDArray[np.uint8], uv: Points) -> Points:
    """Texels, 0 to 1, bilinear between centres, repeated."""
    from scipy.ndimage import map_coordinates

    place = np.stack([1 - uv[:, 1], uv[:, 0]]) % 1.0 * np.array([image.shape[:2]]).T - 0.5
    channels = np.moveaxis(image, -1, 0)
    found = [map_coordinates(c, place, np.float64, order=1, mode="grid-wrap") for c in channels]
    return np.stack(found, 1) / 255


def look_of(mesh: Any, linear: bool, textures: dict[int, npt.NDArray[np.uint8]]) -> Look | None:
    """What a mesh as trimesh reads it looks like; None where its file does not say.

    Args:
        linear: whether the numbers of its file are, as those of glTF.
        textures: those that were read before, by `id`.
    """
    visual, faces = mesh.visual, np.asarray(mesh.faces)
    tint = np.ones((len(faces), 3, 3), np.float32)
    uv = np.zeros((len(faces), 3, 2), np.float32)
    images: tuple[npt.NDArray[np.uint8], ...] = ()
    if visual.kind in ("vertex", "face"):
        by_face = visual.kind == "face"
        tint *= _shares(visual.face_colors[:, None] if by_face else visual.vertex_colors[faces])
    elif visual.kind == "texture":
        material, corner = visual.material, visual.vertex_attributes.get("color")
        texture = getattr(material, "baseColorTexture" if linear else "image", None)
        factor = getattr(material, "baseColorFactor" if linear else "diffuse", None)
        if texture is not None and texture.format is None:
            return None  # trimesh's own, where a file names no material
        if texture is not None and visual.uv is not None:
            images = (textures.setdefault(id(texture), _texture(texture)),)
            uv = np.asarray(visual.uv, np.float32)[faces]
        if factor is not None and (linear or not images):
            tint *= _shares(factor)
        if corner is not None:
            tint *= _shares(corner[faces])
    else:
        return None
    image = np.full(len(faces), len(images) - 1, np.int32)
    return Look(tint, np.full(len(faces), linear), uv, image, images)


def _shares(colour: Rows) -> Rows:
    """Red, green and blue of colours whose last axis has them first, 0 to 1."""
    most = np.iinfo(colour.dtype).max if np.issubdtype(colour.dtype, np.integer) else 1
    return np.asarray(colour[..., :3] / np.float32(most), np.float32)


def _texture(image: Any) -> npt.NDArray[np.uint8]:
    if image.width * image.height > MOST_PIXELS:
        raise ValueError(f"a texture of more than {MOST_PIXELS:,} pixels")
    picture = image.convert("RGB")
    picture.thumbnail((FINEST, FINEST))
    return np.asarray(picture)


def white(count: int) -> Look:
    """The look of triangles of which nothing is said."""
    tint, uv = np.ones((count, 3, 3), np.float32), np.zeros((count, 3, 2), np.float32)
    return Look(tint, np.zeros(count, bool), uv, np.full(count, -1, np.int32))


def joined(looks: Sequence[Look]) -> Look:
    """The look of the triangles of all, in order."""
    shift = np.cumsum([0, *(len(look.images) for look in looks)])
    image = [np.where(a.image >= 0, a.image + s, -1) for a, s in zip(looks, shift, strict=False)]
    tint, linear, uv = (np.concatenate([getattr(a, n) for a in looks]) for n in ("tint", "linear", "uv"))
    images = tuple(image for look in looks for image in look.images)
    return Look(tint, linear, uv, np.concatenate(image).astype(np.int32), images)
