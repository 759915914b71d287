"""Pictures as textures, and drawings and pictures as flat shapes.

A shape is a union of layers: filled areas, and strokes of their drawn width with round joins and ends. A
texture is stored as lossless WebP, which suits drawings, or as an AV1 still picture, whose quality is
searched by halving.
"""

from __future__ import annotations

import io
import re
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, Final, NamedTuple
from unicodedata import normalize
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np
import numpy.typing as npt
from PIL import ExifTags, Image, ImageCms, ImageColor, ImageOps, UnidentifiedImageError, features

from scenelang.assets.element import TEXELS, Element, Facts, Painted, splined
from scenelang.assets.element_file import Font, FontError, load_element_file
from scenelang.assets.picture import frame_of, painted, texels
from scenelang.assets.pyramid import curves_of
from scenelang.assets.records import Record
from scenelang.drawing.exact.mesh import FitError, Points, needed, outer
from scenelang.language import library
from scenelang.language.diagnostics import plural

MOST_OF_PICTURE: Final = dict.fromkeys((".png", ".jpg", ".jpeg"), 32 << 20)  # bytes of a file
MOST_PIXELS: Final = 50_000_000
MOST_DECODED: Final = 1_000_000_000  # pixels times the scans of a JPEG, each of which goes over all of them
NEAR_COLOUR: Final = 0.01  # root mean square off that is near enough: 40 dB
_BEST: Final = 100  # quality of AV1
_PROFILED: Final = "CMYK", "RGB", "L"  # modes whose colours a profile tells of


class Picture(NamedTuple):
    """A picture that is to be a texture."""

    colours: npt.NDArray[np.uint8]  # (h, w, 3), sRGB-encoded, the first row at the top
    notes: tuple[str, ...] = ()  # what was found and changed


class Coded(NamedTuple):
    """A form that was tried."""

    form: str  # its name
    bytes: int
    error: float  # root mean square off, of channels in [0, 1]


@contextmanager
def opened(data: bytes, most: int = MOST_PIXELS) -> Iterator[Image.Image]:
    """A picture (.png, .jpg) of at most so many pixels by its header; all faults become `FitError`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=["PNG", "JPEG"]) as result:
                if result.width * result.height > most:
                    raise FitError(f"a picture of more than {most:,} pixels")
                scans = data.count(b"\xff\xda") if result.format == "JPEG" else 1
                if result.width * result.height * scans > MOST_DECODED:
                    raise FitError(f"a picture of {scans:,} scans")
                yield result
    except (FitError, MemoryError):
        raise
    except UnidentifiedImageError:
        raise FitError("neither a PNG nor a JPEG") from None
    except Exception as error:  # readers of large formats, which a stranger's file may break in many ways
        raise FitError(f"damaged or not a picture: {error}"[:200]) from error


def read_picture(data: bytes, side: int = TEXELS) -> Picture:
    """Read a picture (.png, .jpg): turned as its EXIF says, in sRGB, laid over white, of at most a side."""
    with opened(data) as file:
        notes = [f"{file.width} × {file.height} pixels"]
        image = ImageOps.exif_transpose(file)
        if file.getexif().get(ExifTags.Base.Orientation, 1) != 1:
            notes.append("turned as its EXIF says")
        if image.mode.startswith("I"):  # 16 bits of grey
            grey = np.asarray(image).astype(np.float64) / 257
            image = Image.fromarray(np.clip(grey + 0.5, 0, 255).astype(np.uint8))
            notes.append("16 bits made 8")
        elif image.has_transparency_data:
            image = image.convert("RGBA")
        cover = image.getchannel("A") if image.mode == "RGBA" else None
        plain = image if image.mode in _PROFILED else image.convert("RGB")
        plain = _profiled(plain, file.info.get("icc_profile"), notes).convert("RGB")
        if cover is not None and cover.getextrema() != (255, 255):
            plain = Image.composite(plain, Image.new("RGB", plain.size, "white"), cover)
            notes.append("laid over white")
        if (longer := max(plain.size)) > side:
            width, height = (max(1, round(length * side / longer)) for length in plain.size)
            plain = plain.resize((width, height), Image.Resampling.LANCZOS)
            notes.append(f"made {width} × {height}")
        return Picture(np.asarray(plain), tuple(notes))


def _profiled(image: Image.Image, profile: bytes | None, notes: list[str]) -> Image.Image:
    """A picture in sRGB whose colours a profile tells of."""
    if not profile:
        return image
    try:
        known = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        called = "".join(c for c in ImageCms.getProfileDescription(known).strip() if c.isprintable())[:60]
        if "srgb" in called.lower():
            return image
        result = ImageCms.profileToProfile(image, known, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):
        notes.append("its colour profile cannot be read: taken as sRGB")
        return image
    notes.append(f"from the colour profile `{called}`")
    return result or image


def fit_picture(
    picture: Picture,
    name: str,
    *,
    max_error: float | None = None,
    budget_s: float = np.inf,
    steps: int | None = None,
    about: Facts | None = None,
    report: Callable[[Coded], None] = lambda coded: None,
) -> tuple[Element, list[Coded]]:
    """The smallest texture whose root mean square error, of channels in [0, 1], is at most ``max_error``.

    At most ``steps`` are tried, none after ``budget_s`` seconds; the same number gives the same bytes.
    ``about`` is what the element says of itself; ``report`` is called with each that was tried.
    """
    started, tried, asked = time.monotonic(), [], max_error or NEAR_COLOUR
    true = picture.colours.astype(np.float32) / np.float32(255)

    def measured(element: Element, form: str) -> float:
        error = float(np.sqrt(np.square(texels(element) - true, dtype=np.float64).mean()))
        tried.append(Coded(form, len(element.data), error))
        report(tried[-1])
        return error

    best, error, ended = painted(name, picture.colours), 0.0, "near enough"
    measured(best, "without loss")
    low, high = (0, _BEST) if features.check("avif") else (1, 0)
    while low <= high:
        if len(tried) >= steps if steps is not None else time.monotonic() - started > budget_s:
            ended = "steps"
            break
        quality = (low + high) // 2
        file = io.BytesIO()  # an AV1 still picture, with as many samples of colour as of light
        still = {"quality": quality, "subsampling": "4:4:4", "speed": 6, "max_threads": 1}
        Image.fromarray(picture.colours).save(file, "AVIF", **still)
        element = Element(name, "picture", best.sizes, "av1", frame_of(file.getvalue()))
        if (off := measured(element, f"quality {quality}")) > asked:
            low = quality + 1
            if len(element.data) >= len(best.data):
                break
        else:
            high = quality - 1
            if len(element.data) < len(best.data):
                best, error = element, off
    said = {**(about or {}), "error": error, "steps": len(tried), "ended": ended}
    return Element(name, "picture", best.sizes, best.coding, best.data, said), tried


MOST_EDGES: Final = 200_000
MOST_TRACED: Final = 16_000_000
PIECE: Final = 0.004  # leaf units: longer edges are cut, so that the nearest middle is of a near piece
STRIP: Final = 64  # points of neighbouring heights
_TOGETHER: Final = 10_000  # edges that are asked at a time
_FINE: Final = 0.002  # leaf units: longest edge along a curve of an element
_FEW_EDGES: Final = 32  # of which all are asked
_FLAT: Final = 4e-6  # leaf units: farthest that edges lie off a spline
_BESIDE: Final = 1e-4  # leaf units from an edge to where its sides are asked
Edges = npt.NDArray[np.float64]  # (E, 2, 2): edges, ends, coordinates
Inside = Callable[[Points], npt.NDArray[np.bool_]]


class Layer(Record, frozen=False):
    """The area on one side of edges, or near them."""

    edges: Edges
    inside: Inside | None  # tells of points (M, 2) whether the layer covers them; None of a stroke
    half: float = 0.0  # of a stroke's width
    color: Painted = ()  # sRGB, 0 to 1; empty where it has none

    def box(self) -> tuple[Points, Points]:
        """The least and the greatest coordinates."""
        return self.edges.min((0, 1)) - self.half, self.edges.max((0, 1)) + self.half

    def touches(self, other: Layer) -> bool:
        """True where the boxes around both share a point."""
        (a, b), (c, d) = self.box(), other.box()
        return bool((a <= d).all() and (c <= b).all())

    def pieces(self) -> Edges:
        """Edges cut to `PIECE`, of a filled area those with just one side in it."""
        length = np.linalg.norm(self.edges[:, 1] - self.edges[:, 0], axis=1)
        counts = np.maximum(1, np.ceil(length / PIECE)).astype(int)
        if counts.sum() > 20 * MOST_EDGES:
            raise FitError("its outline is too long")
        at = np.repeat(np.arange(len(counts)), counts)
        step = np.arange(len(at)) - np.repeat(np.cumsum(counts) - counts, counts)
        a, b = self.edges[at, 0], self.edges[at, 1]
        result = np.stack([a + ((step + k) / counts[at])[:, None] * (b - a) for k in (0, 1)], 1)
        if self.inside is None:
            return result
        middle, beside = result.mean(1), _BESIDE * _normals(result)
        return np.asarray(result[self.inside(middle + beside) != self.inside(middle - beside)])


def _normals(edges: Edges) -> Points:
    along = edges[:, 1] - edges[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    return np.asarray(np.stack([along[:, 1], -along[:, 0]], 1) / length)


class Outline:
    """A flat shape in the unit disc: the midpoint of its bounding box is the origin, its farthest point at 1.
    Another ``disc`` may be given, by its middle and radius. Raises `FitError` where the layers cover nothing.
    """

    dimension = 2

    def __init__(
        self,
        layers: list[Layer],
        notes: tuple[str, ...] = (),
        disc: tuple[tuple[float, float], float] | None = None,
    ) -> None:
        with needed("scipy"):
            from scipy.spatial import cKDTree
        self.notes, self._source = notes, layers
        if not layers or sum(len(layer.edges) for layer in layers) == 0:
            raise FitError("it draws nothing")
        if sum(len(layer.edges) for layer in layers) > MOST_EDGES:
            raise FitError(f"an outline of more than {MOST_EDGES:,} edges")
        ends = np.concatenate([layer.edges.reshape(-1, 2) for layer in layers])
        halves = np.concatenate([np.full(2 * len(layer.edges), layer.half) for layer in layers])[:, None]
        low, high = (ends - halves).min(0), (ends + halves).max(0)
        if not np.isfinite([low, high]).all():
            raise FitError("a point is not finite")
        middle = (low + high) / 2 if disc is None else np.array(disc[0])
        self.size = float((np.linalg.norm(ends - middle, axis=1) + halves[:, 0]).max())
        self.size = self.size if disc is None else disc[1]
        self.centre = (float(middle[0]), float(middle[1]))
        if not self.size > 1e-12 * (1 + abs(middle).max()):
            raise FitError("all of it lies at one point")
        self._layers = []
        for layer in layers:
            inside = None if layer.inside is None else _moved(layer.inside, middle, self.size)
            moved = Layer((layer.edges - middle) / self.size, inside, layer.half / self.size)
            if len(pieces := moved.pieces()):
                self._layers.append((moved, pieces, cKDTree(pieces.mean(1))))
        if not self._layers:
            raise FitError("it covers nothing")

    def painted(self) -> list[tuple[Painted, list[Layer]]]:
        """Its colours in the order of painting, and the layers of each, joined where nothing lies between."""
        result: list[tuple[Painted, list[Layer]]] = []
        for layer in self._source:
            for color, layers in reversed(result):
                if color == layer.color:
                    layers.append(layer)
                    break
                if any(layer.touches(other) for other in layers):
                    result.append((layer.color, [layer]))
                    break
            else:
                result.append((layer.color, [layer]))
        return result

    def distances(self, p: Points) -> Points:
        """Signed distances (M,) of points (M, 2), negative inside."""
        result = np.full(len(p), np.inf)
        for layer, pieces, tree in self._layers:
            _, near = tree.query(p, k=min(4, len(pieces)))
            ends = pieces[near.reshape(len(p), -1)]  # (M, k, 2, 2)
            a, along = ends[:, :, 0], ends[:, :, 1] - ends[:, :, 0]
            share = ((p[:, None] - a) * along).sum(2) / np.maximum((along * along).sum(2), 1e-30)
            away = np.linalg.norm(a + share.clip(0, 1)[..., None] * along - p[:, None], axis=2).min(1)
            if layer.inside is None:
                away -= layer.half
            else:
                away[layer.inside(p)] *= -1
            result = np.minimum(result, away)
        return result

    def surface(self, count: int) -> tuple[Points, Points, float]:
        """As `Mesh.surface`; raises `FitError` where nothing is thick enough to have an outline."""
        random, points, normals = np.random.default_rng(1), [], []
        for layer, pieces, _ in self._layers:
            way = _normals(pieces)
            for side in (1, -1) if layer.inside is None else (1,):
                points.append(pieces.mean(1) + side * layer.half * way)
                normals.append(side * way)
        all_points, all_normals = np.concatenate(points), np.concatenate(normals)
        chosen = random.choice(len(all_points), min(count, len(all_points)), replace=False)
        result, out, thin = outer(self.distances, all_points[chosen], all_normals[chosen], _BESIDE)
        if not len(result):
            raise FitError(f"it is nowhere thicker than {_BESIDE:g} of its radius")
        return result, out, thin


def of_curves(element: Element) -> Outline:
    """The outline of an element of quadratic curves, in its own disc."""
    a, b, c = curves_of(element).swapaxes(0, 1)
    length = np.where((2 * b == a + c).all(1), 0.0, np.hypot(*(b - a).T) + np.hypot(*(c - b).T))
    edges = []
    for start, by, end, count in zip(a, b, c, np.ceil(length / _FINE).astype(int).clip(1), strict=True):
        t = np.linspace(0, 1, count + 1)[:, None]
        points = (1 - t) ** 2 * start + 2 * t * (1 - t) * by + t**2 * end
        edges.append(np.stack([points[:-1], points[1:]], 1))
    joined = np.concatenate(edges)
    return Outline([Layer(joined, winding(joined, odd=False))], disc=((0.0, 0.0), 1.0))


class PointShape:
    """A polygon or a spline by its points, the spline flattened to `_FLAT` of its radius; every edge counts,
    also one that others cover.
    """

    dimension = 2

    def __init__(self, element: Element) -> None:
        with needed("scipy"):
            from scipy.spatial import cKDTree
        line = np.array(element.points)
        if element.form == "spline":
            a, b, c, d = np.array(splined(element.points)).swapaxes(0, 1)
            bend = np.maximum(np.hypot(*(a - 2 * b + c).T), np.hypot(*(b - 2 * c + d).T))
            count = np.ceil(np.sqrt(0.75 * bend / _FLAT)).astype(int).clip(1)
            which = np.repeat(np.arange(len(a)), count)
            t = ((np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)) / count[which])[:, None]
            s, (a, b, c, d) = 1 - t, (at[which] for at in (a, b, c, d))
            line = s**3 * a + 3 * s * s * t * b + 3 * s * t * t * c + t**3 * d
        edges = np.stack([line, np.roll(line, -1, 0)], 1)
        self.inside, self._few = winding(edges, odd=False), len(edges) <= _FEW_EDGES
        self._pieces = edges if self._few else Layer(edges, None).pieces()
        self._ends, self._middles = cKDTree(self._pieces[:, 0]), cKDTree(self._pieces.mean(1))

    def distances(self, p: Points) -> Points:
        """Signed distances (M,) of points (M, 2), negative inside."""
        if self._few:
            away = np.full(len(p), np.inf)
            for a, c in self._pieces:
                away = np.minimum(away, _from_edges(p, a, c - a))
        else:  # where it is no end that is nearest, the middle of its piece is farther by h^2 / 2 d at most
            near = self._middles.query(p, k=6)[1]
            a, along = self._pieces[near, 0], np.diff(self._pieces[near], axis=2)[:, :, 0]
            away = np.minimum(_from_edges(p[:, None], a, along).min(1), self._ends.query(p)[0])
        return np.where(self.inside(p), -away, away)


def _from_edges(p: Points, a: Points, along: Points) -> Points:
    """Distances of points (…, 2) from edges by their starts and ways (…, 2)."""
    share = ((p - a) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-300)
    off = a + share.clip(0, 1)[..., None] * along - p
    return np.asarray(np.hypot(off[..., 0], off[..., 1]))


@lru_cache(maxsize=256)
def of_element(element: Element) -> Outline | PointShape:
    """The true shape of what is `curved`."""
    return of_curves(element) if element.form == "outline" else PointShape(element)


def _moved(inside: Inside, middle: Points, size: float) -> Inside:
    return lambda p: inside(p * size + middle)


def winding(edges: Edges, odd: bool) -> Inside:
    """A test of points against closed polygons, by the rule ``nonzero`` or ``evenodd``."""

    low, high = edges[..., 1].min(1), edges[..., 1].max(1)

    def inside(p: Points) -> npt.NDArray[np.bool_]:
        total, order = np.zeros(len(p), np.int64), np.argsort(p[:, 1])
        for first in range(0, len(p), STRIP):  # points of a strip, and the edges that reach into it
            at = order[first : first + STRIP]
            x, y = p[at].T[..., None]
            reach = edges[(low <= y[-1]) & (high >= y[0])]
            for part in (reach[k : k + _TOGETHER] for k in range(0, len(reach), _TOGETHER)):
                (ax, ay), (bx, by) = part.swapaxes(0, 1).swapaxes(1, 2)
                up, down = (ay <= y) & (by > y), (ay > y) & (by <= y)
                left = (bx - ax) * (y - ay) - (x - ax) * (by - ay) > 0
                total[at] += (up & left).sum(1) - (down & ~left).sum(1)
        return np.asarray(total % 2 != 0 if odd else total != 0)

    return inside


def traced(data: bytes) -> tuple[list[Layer], tuple[str, ...]]:
    """The outline of the dark or opaque part of a picture in the bytes of a file."""
    with opened(data, MOST_TRACED) as file:
        pixels = np.asarray(file.convert("RGBA"), float) / 255
    opaque = bool((pixels[..., 3] < 0.5).any())
    luma = pixels[..., :3] @ (0.2126, 0.7152, 0.0722)
    value = pixels[..., 3] if opaque else 1 - luma
    value = np.pad(value, 1)[::-1]  # y up, and nothing outside
    note = "its opaque part" if opaque else "its dark part"
    with needed("contourpy"):
        from contourpy import contour_generator
    lines: Any = contour_generator(z=value).lines(0.5)
    edges = np.concatenate([np.zeros((0, 2, 2)), *(np.stack([line[:-1], line[1:]], 1) for line in lines)])
    return [Layer(edges, winding(edges, odd=True))], (note,)


MOST_OF_DRAWING: Final = dict.fromkeys((".svg", ".png", ".jpg", ".jpeg"), 10 << 20)  # bytes of a file
Face = Callable[[str], Font]  # the font of all texts, asked for some letters
_CURVE: Final = 48  # edges of a curve
_PAINT: Final = re.compile(r"""url\(\s*['"]?#([^)'"\s]+)['"]?\s*\)[^;"}]*""")  # and what is meant without it
_OPACITY: Final = re.compile(r"(?<![-\w])opacity\s*:\s*([^;]*)")
_MOST_DRAWN: Final = 50_000  # elements of a drawing, each counted as often as it is used
_MOST_STYLE: Final = 100_000  # letters of its style sheets, which are read again for each element
_MOST_SAID: Final = 1_000_000  # letters of its paths, transforms and styles
_UNSEEN: Final = frozenset(("mask", "marker", "filter", "clipPath"))
_STYLED: Final = re.compile(r"([-\w]+)\s*:\s*([^;{}]+)")  # a declaration of a style
_SELECTOR: Final = re.compile(r"[#.]?[-\w]+|\*|[-\w]+[.#][-\w]+")  # one that is understood
_COLOUR: Final = re.compile(r"\b(rgb|hsl)a?\(([^()]*)\)", re.IGNORECASE)
_NUMBERS: Final = r"(,?[-+.0-9]+%?){3},?[-+.0-9]+%?"
_PLAIN: Final = re.compile(
    rf"(#[0-9a-f]{{3,8}}|none|transparent|currentcolor|(rgb|hsl)a\({_NUMBERS}\))( *!important)?"
)
_LOST: Final = {
    "stroke-dasharray": ("dashes drawn solid", {"none", "0"}),
    "stroke-linejoin": ("joins drawn round", {"round"}),
    "stroke-linecap": ("ends drawn round", {"round"}),
    "vector-effect": ("widths of strokes scaled", {"none"}),
    "paint-order": ("fills painted before strokes", {"normal", "fill", "fill stroke"}),
    "mix-blend-mode": ("blend modes left out", {"normal"}),
    "clip-path": ("clip paths left out", {"none"}),
    **dict.fromkeys(("mask", "mask-image"), ("masks left out", {"none"})),
    **{key: ("markers left out", {"none"}) for key in ("marker", "marker-start", "marker-mid", "marker-end")},
    "filter": ("filters left out", {"none"}),
}
"""Properties that are not read, what that does, and the values that mean the same without."""
_LOST_TAGS: Final = {
    "image": "images", "foreignObject": "foreign objects", "textPath": "texts along paths",
    "pattern": "patterns", "animateMotion": "animations",
    **dict.fromkeys(("animate", "animateTransform", "set"), "animations"),
}  # fmt: skip
_RELATIVE: Final = re.compile(r"[-+.0-9]+(em|ex|rem|ch|vw|vh)")
_NAMED_LINES: Final = 5  # of a note


def read_outline(data: bytes, suffix: str, face: Face | None = None) -> Outline:
    """A drawing (.svg), or the dark or opaque part of a picture, in the bytes of a file."""
    return Outline(*(drawn(data, face) if suffix == ".svg" else traced(data)))


def drawn(data: bytes, face: Face | None = None) -> tuple[list[Layer], tuple[str, ...]]:
    """The layers of a drawing in the order of painting, y up, and what there is to say of it."""
    with needed("svgelements"):
        import svgelements
    try:  # a reader of a large format, which a stranger's file may break in many ways
        root = ElementTree.fromstring(data)
        notes = [*_unread(root, data), *_simplified(root, svgelements)]
        simple = io.BytesIO(ElementTree.tostring(root))
        parsed = [*svgelements.SVG.parse(simple, reify=True).elements()]
        layers, left_out, edges = list[Layer](), dict[str, None](), 0
        texts = [element.text or "" for element in parsed if isinstance(element, svgelements.Text)]
        joined = " ".join(["", *texts])
        letters = "".join(sorted({*joined, *normalize("NFC", joined)}))
        font = None if not texts else face(letters) if face else load_element_file(_LETTERS).font
        for element in parsed:
            if isinstance(element, svgelements.Shape):
                layers += _layers(element, svgelements)
            elif isinstance(element, svgelements.Text):
                own = [*_written(element, font, face is None, left_out)]
                edges += sum(len(layer.edges) for layer in own)
                if edges > MOST_EDGES:
                    raise FitError(f"texts of more than {MOST_EDGES:,} edges")
                layers += own
        notes += [f"text left out: {said}" for said in left_out]
    except (FitError, MemoryError):
        raise
    except Exception as error:
        raise FitError(f"damaged or not a drawing: {str(error) or type(error).__name__}"[:200]) from error
    strokes = sum(layer.inside is None for layer in layers)
    counts = f"{plural(len(layers) - strokes, 'area')}, {plural(strokes, 'stroke')}"
    return layers, (counts, *notes)


def _unread(root: Any, data: bytes) -> list[str]:
    """Notes of what is not read of a drawing, with lines; rewrites colours as svgelements has them."""
    lines, found = list[int](), dict[str, list[int]]()
    reader = expat.ParserCreate()
    reader.StartElementHandler = lambda *_: lines.append(reader.CurrentLineNumber)
    reader.Parse(data, True)
    names = {element.get("id") for element in root.iter()}
    for element, line in zip(root.iter(), lines, strict=True):
        tag = element.tag.rpartition("}")[2]
        for key, value in element.items():
            if key in ("fill", "stroke", "stop-color", "style"):
                element.set(key, _COLOUR.sub(_commas, value))
            if key in ("fill", "stroke") and value.strip() == "inherit":
                del element.attrib[key]
        styles = [element.get("style", "")]
        if tag == "style":
            element.text = _COLOUR.sub(_commas, re.sub(r"/\*.*?\*/", "", element.text or "", flags=re.DOTALL))
            styles = [element.text]
            for selector in re.findall(r"([^{}]+)\{", element.text):
                if not all(_SELECTOR.fullmatch(one.strip()) for one in selector.split(",")):
                    rule = " ".join(selector.split())[:40]
                    found.setdefault(f"the rule of `{rule}` left out", []).append(line)
        said = [f"{_LOST_TAGS[tag]} left out"] if tag in _LOST_TAGS else []
        if tag == "use" and _href(element) not in names:
            said.append(f"a use of `{_href(element)[:40]}`, which is not there, left out")
        declared = [*element.items(), *(pair for text in styles for pair in _STYLED.findall(text))]
        bare = ("stroke", "none") in declared
        for key, value in ((key, value.strip().lower()) for key, value in declared):
            if key in _LOST and value not in _LOST[key][1] and not (bare and key.startswith("stroke-")):
                said.append(_LOST[key][0])
            paint = key in ("fill", "stroke", "stop-color") and not value.startswith("url(")
            if paint and not _PLAIN.fullmatch(value) and value.split(" ")[0] not in ImageColor.colormap:
                said.append(f"`{value[:40]}` drawn black")
            if _RELATIVE.fullmatch(value) and key != "font-size" and tag != "svg":
                said.append(f"the unit of `{value[:40]}` left out")
        for note in dict.fromkeys(said):
            found.setdefault(note, []).append(line)
    return [f"{note} ({_places(at)})" for note, at in found.items()]


def _places(lines: list[int]) -> str:
    shown = ", ".join(map(str, list(dict.fromkeys(lines))[:_NAMED_LINES]))
    more = len(set(lines)) - _NAMED_LINES
    return f"line{'s' * (len(set(lines)) > 1)} {shown}{f' and {more} more' if more > 0 else ''}"


def _commas(match: re.Match[str]) -> str:
    """A colour with commas between its numbers, as svgelements has it."""
    *channels, alpha = [*re.split(r"[\s,/]+", match[2].strip().lower()), "1"][:4]
    return f"{match[1].lower()}a({','.join(c.removesuffix('deg') for c in channels)},{_share(alpha)})"


def _fitted(
    element: Any, outer: tuple[float, float], view: str, how: str, svg: Any
) -> tuple[str, tuple[float, float]]:
    """The transform of an inner drawing's contents, by its place, size and view, and the size they see."""
    usual = (("x", "0"), ("y", "0"), ("width", "100%"), ("height", "100%"))
    lengths = [svg.Length(element.get(key, text)) for key, text in usual]
    x, y, width, height = (float(one.value(96, outer[k % 2], 16)) for k, one in enumerate(lengths))
    numbers = [float(number) for number in re.split(r"[\s,]+", view.strip()) if number]
    if len(numbers) != 4 or not min(numbers[2:]) > 0:
        return f"translate({x} {y})", (width, height)
    wide, high = width / numbers[2], height / numbers[3]
    if "none" not in how:
        wide = high = max(wide, high) if "slice" in how else min(wide, high)
        x += (width - wide * numbers[2]) * (0.0 if "xMin" in how else 1.0 if "xMax" in how else 0.5)
        y += (height - high * numbers[3]) * (0.0 if "YMin" in how else 1.0 if "YMax" in how else 0.5)
    moves = f"translate({x} {y}) scale({wide} {high}) translate({-numbers[0]} {-numbers[1]})"
    return moves, (numbers[2], numbers[3])


def _simplified(root: Any, svg: Any) -> list[str]:
    """Change a tree into what svgelements draws as it is meant; what is lost by that."""
    result = [(element, element.tag.rpartition("}")[2]) for element in root.iter()]
    named = {element.get("id"): element for element, _ in result}
    if sum(len(element.text or "") for element, tag in result if tag == "style") > _MOST_STYLE:
        raise FitError(f"style sheets of more than {_MOST_STYLE:,} letters")
    said = (value for element, _ in result for key, value in element.items() if not key.endswith("href"))
    if sum(map(len, said)) > _MOST_SAID:
        raise FitError(f"paths and styles of more than {_MOST_SAID:,} letters")
    if _drawn(root, named) > _MOST_DRAWN:
        raise FitError(f"a drawing of more than {_MOST_DRAWN:,} elements")
    gradients = [element for element, tag in result if tag.endswith("Gradient")]
    means = {element.get("id"): _mean(element, named, svg) for element in gradients}
    notes = ["gradients in their mean colours"] if means else []
    seen = _fitted(root, (300.0, 150.0), root.get("viewBox", ""), "", svg)[1]
    views = dict.fromkeys(root, seen)  # the size of what each lies in
    for element, tag in result[1:]:
        used = named.get(_href(element))
        inner = element if tag == "svg" else used if tag == "use" and used is not None else None
        size = views[element]
        if inner is not None and (tag == "svg" or (inner.tag.endswith("symbol") and inner.get("viewBox"))):
            ratio = inner.get("preserveAspectRatio", "")
            moves, size = _fitted(element, size, inner.get("viewBox", ""), ratio, svg)
            element.set("transform", f"{element.get('transform', '')} {moves}")
            for key in ("x", "y", "width", "height", "viewBox"):
                element.attrib.pop(key, None)
            element.tag = element.tag.removesuffix("svg") + "g" if tag == "svg" else element.tag
        views |= dict.fromkeys(element, size)
    for element, _ in result:
        for key in ("fill", "stroke", "style"):
            if key in element.attrib:
                element.set(key, _PAINT.sub(lambda match: means.get(match[1], "none"), element.get(key)))
        if element.text and "url(" in element.text:
            element.text = _PAINT.sub(lambda match: means.get(match[1], "none"), element.text)
    for element, _ in result:
        opacity = _opacity(element)
        for child in list(element):
            tag = child.tag.rpartition("}")[2]
            if tag in _UNSEEN:
                element.remove(child)
            elif tag == "symbol":  # seen where it is used
                element.remove(child)
                ElementTree.SubElement(element, child.tag.replace("symbol", "defs")).append(child)
            elif (own := opacity * _opacity(child)) < 1:
                child.set("opacity", str(own))
    if any(_opacity(element) < 1 or "opacity" in "".join(element.attrib) for element, _ in result):
        notes.append("what is not opaque mixed with white")
    return notes


def _drawn(root: Any, named: dict[str, Any]) -> int:
    """Number of elements that svgelements visits; a use of itself counts as too many."""
    counts: dict[Any, int] = {}
    waiting = [(root, False)]
    while waiting:
        element, counted = waiting.pop()
        used = named.get(_href(element)) if element.tag.endswith("use") else None
        inner = [*element, *([] if used is None else [used])]
        if counted:
            counts[element] = 1 + sum(counts[part] or _MOST_DRAWN for part in inner)
        elif element not in counts:
            counts[element] = 0  # until all in it are
            waiting += [(element, True), *((part, False) for part in inner)]
    return counts[root]


def _href(element: Any) -> str:
    """The name that an element refers to, or an empty text."""
    return next((value[1:] for key, value in element.attrib.items() if key.endswith("href")), "")


def _opacity(element: Any) -> float:
    style = _OPACITY.search(element.get("style", ""))
    return _share(element.get("opacity") or (style[1] if style else "1"))


def _share(text: str) -> float:
    """A number from 0 to 1, which may be written in per cent; 1 of what is none."""
    try:
        number = float(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)
    except ValueError:
        return 1.0
    return min(max(number, 0.0), 1.0)


def _mean(gradient: Any, named: dict[str, Any], svg: Any) -> str:
    """The mean colour of a gradient, which may have the stops of another."""
    for _ in range(9):
        stops = [child for child in gradient if child.tag.endswith("stop")]
        if stops or _href(gradient) not in named:
            break
        gradient = named[_href(gradient)]
    rows = []
    for stop in stops:
        style = dict(part.split(":", 1) for part in stop.get("style", "").split(";") if ":" in part)
        given = {key.strip(): value.strip() for key, value in (stop.attrib | style).items()}
        colour = svg.Color(given.get("stop-color", "black"))
        alpha = _share(given.get("stop-opacity", "1")) * (colour.alpha or 0) / 255
        rows.append((_share(given.get("offset", "0")), colour.red, colour.green, colour.blue, alpha))
    if not rows:
        return "none"
    offsets, *channels = np.array(rows, float).T
    at = (np.arange(64) + 0.5) / 64
    red, green, blue, alpha = (np.interp(at, offsets, channel) for channel in channels)
    weight = alpha / max(alpha.sum(), 1e-9)
    shown = [round((channel * weight).sum()) for channel in (red, green, blue)]
    return "#" + bytes([*shown, round(255 * alpha.mean())]).hex()


def _seen(paint: Any, shape: Any) -> Painted | None:
    """The colour of a paint on white; None of one that is not seen."""
    if paint is None or paint.value is None:
        return None
    alpha = paint.alpha / 255 * _share(str(shape.values.get("opacity", "1")))
    if alpha == 0:
        return None
    channels = (paint.red, paint.green, paint.blue)
    red, green, blue = (round(1 - alpha * (1 - channel / 255), 4) for channel in channels)
    return red, green, blue


def _layers(shape: Any, svg: Any) -> Iterator[Layer]:
    """Layers that a shape of a drawing paints, y up."""
    open_edges, closing = [], []
    for part in svg.Path(shape).as_subpaths():
        points = [at for segment in svg.Path(part) for at in _ends(segment, svg)]
        if len(points) > 1:
            line = np.array(points) * (1.0, -1.0)
            open_edges.append(np.stack([line[:-1], line[1:]], 1))
            closing.append(np.stack([line[-1:], line[:1]], 1))
    if not open_edges:
        return
    edges, closed = np.concatenate(open_edges), np.concatenate([*open_edges, *closing])
    if shape.values.get("visibility") in ("hidden", "collapse"):
        return
    if (color := _seen(shape.fill, shape)) is not None:
        odd = shape.values.get("fill-rule") == "evenodd"
        yield Layer(closed, winding(closed, odd), color=color)
    width = float(shape.stroke_width or 0.0)
    if (color := _seen(shape.stroke, shape)) is not None and width > 0:
        yield Layer(edges, None, width / 2, color)


_SANS: Final = frozenset(("sans-serif", "system-ui", "ui-sans-serif", "inter", "arial", "helvetica"))
_LETTERS: Final = library.find("std/letters") or ""
_MOST_WRITTEN: Final = 300  # letters of a text
_OF_LETTERS: Final = 16  # edges of a curve of a letter


def _written(text: Any, font: Any, sans: bool, left_out: dict[str, None]) -> Iterator[Layer]:
    """The layer of a text of a drawing, if ``sans`` in a family of these; if none, ``left_out`` says why."""
    words = " ".join((text.text or "").split())
    color = _seen(text.fill, text)
    if not words or color is None or text.values.get("visibility") in ("hidden", "collapse"):
        return
    families = [name.strip(" '\"").lower() for name in (text.font_family or "sans-serif").split(",")]
    if sans and not _SANS & {*families}:
        left_out[f"`{families[0][:40]}` is not at hand, --font brings it"] = None
        return
    if len(words) > _MOST_WRITTEN:
        left_out[f"more than {_MOST_WRITTEN:,} letters"] = None
        return
    if text.values.get("tag") == "tspan" and "x" not in text.values.get("attributes", text.values):
        left_out["a tspan without a place"] = None
        return
    try:
        line, width = font.line(words)
    except FontError as error:
        left_out[str(error)] = None
        return
    size, m = float(text.font_size), text.transform
    left = width * {"middle": 0.5, "end": 1.0}.get(text.anchor, 0.0)
    edges = []
    for name, x, y, radius in line:
        a, b, c = (radius * curves_of(font.glyphs[name])[:, :, None] + (x - left, y)).swapaxes(0, 1)
        t = np.linspace(0, 1, _OF_LETTERS + 1)[:, None]
        points = size * ((1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c) * (1.0, -1.0)
        points += (float(text.x) + float(text.dx or 0), float(text.y) + float(text.dy or 0))
        points = points @ np.array([[m.a, m.b], [m.c, m.d]]) + (m.e, m.f)
        edges.append(np.stack([points[:, :-1], points[:, 1:]], 2).reshape(-1, 2, 2) * (1.0, -1.0))
    if edges:
        joined = np.concatenate(edges)
        yield Layer(joined, winding(joined, odd=False), color=color)


def _ends(segment: Any, svg: Any) -> list[tuple[float, float]]:
    """Points of a segment, its last one among them."""
    if segment.end is None:
        return []
    if isinstance(segment, svg.Move | svg.Line | svg.Close):
        return [(segment.end.x, segment.end.y)]
    result = [segment.point(at) for at in np.linspace(0, 1, _CURVE + 1)[1:]]
    return [(point.x, point.y) for point in result]
