"""Scenes as pages that draw themselves: the view of a scene, its text for screen readers, the page."""

from __future__ import annotations

import base64
import colorsys
import hashlib
import io
import json
import os
import re
import unicodedata
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from importlib.metadata import version
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from scenelang.assets.element import Element, credit_of
from scenelang.assets.files import write_output
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.groups import SMOOTH, SUBTRACT, UNION, read_groups
from scenelang.compiler.lifting import LAYOUTS
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program, ProgramError, load_program, written
from scenelang.compiler.spaces import encoded, stage_data
from scenelang.drawing.how import OutOfTime
from scenelang.drawing.neural.draw import timed
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import FramedArrays
from scenelang.drawing.render import render
from scenelang.drawing.solid.network import SolidArrays
from scenelang.language import library
from scenelang.language.diagnostics import Diagnostic, Diagnostics
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.reports import SceneError
from scenelang.language.scene import Animation, Scene
from scenelang.web import plane, solid
from scenelang.web.arrays import ArrayStore, packed, paints_of, rows_of, script, shapes_of, web, worn_of
from scenelang.web.form import PageProgram, form_of
from scenelang.web.volume import FULL, OPEN, Detail, volume

if TYPE_CHECKING:
    import PIL.Image

    from scenelang.drawing.image import Image

MOST: Final = 5  # kinds of objects, and colours, that a text names
_HUES: Final = (
    (0.03, "red"),
    (0.11, "orange"),
    (0.18, "yellow"),
    (0.42, "green"),
    (0.53, "turquoise"),
    (0.69, "blue"),
    (0.80, "purple"),
    (0.95, "pink"),
    (1.00, "red"),
)  # the largest hue, in turns, of each name

_PLURALS: Final = {"torus": "tori"}


def alternative(data: dict[str, Any]) -> str:
    """The alternative text of a view's data."""
    program, animation, solid = data["program"], data["animation"], data["dimension"] == 3
    rows = program["rows"]
    shapes = [shape["name"] for shape in data["shapes"]]
    groups = read_groups(np.array([row["token"] for row in rows], np.int8))
    around = np.append(groups.joins, UNION)[groups.path]
    joins = np.column_stack([around, groups.tokens])  # of rows and of the groups that they are in
    holes, drawn = (joins == SUBTRACT).any(1), (joins <= SMOOTH).all(1)
    counts = Counter(shapes[rows[at]["shape"]] for at in np.flatnonzero(~holes))
    several = {name: f"{n:,} {_PLURALS.get(name, f'{name}s')}" for name, n in counts.most_common(MOST)}
    one = {name: f"{'an' if name[0] in 'aeiou' else 'a'} {name}" for name, n in counts.items() if n == 1}
    parts = _listed([one.get(name, text) for name, text in several.items()], len(counts))
    said = f"A {'3D scene' if solid else 'picture'} of {parts}" if parts else "An empty picture"
    if count := int(holes.sum()):
        said += f", with {count:,} cut-outs" if count > 1 else ", with a cut-out"
    colours: Counter[str] = Counter()
    for row in (rows[at] for at in np.flatnonzero(drawn) if rows[at]["paint"] < 0):
        albedo = data["materials"][row["material"]]["albedo"]
        r, g, b = (a * c for a, c in zip(albedo, row["colour"], strict=True))
        colours[colour_name(encoded((r, g, b)) if solid else (r, g, b))] += 1
    if colours:
        said += f", in {_listed([name for name, _ in colours.most_common(MOST)], len(colours))}"
    stage, background = program["stage"], program["background"]
    if stage:
        said += "" if stage["transparent"] else f", under a {colour_name(encoded(stage['zenith']))} sky"
        said += ", on the ground" if stage["ground"] else ""
    elif background:
        said += f", on {colour_name(background)}"
    said += "."
    if animation:
        again = ", over and over" * bool(animation["loop"])
        said += f" It moves for {animation['seconds']:g} seconds{again}."
    return said


def colour_name(rgb: Iterable[float]) -> str:
    """The name of an sRGB colour, in one or two words."""
    r, g, b = (min(1.0, max(0.0, float(v))) for v in rgb)
    hue, light, _ = colorsys.rgb_to_hls(r, g, b)
    chroma = max(r, g, b) - min(r, g, b)
    if light > 0.96 or (light > 0.88 and chroma < 0.12):
        return "white"
    if light < 0.08:
        return "black"
    if chroma < 0.08:
        return "light grey" if light > 0.7 else "dark grey" if light < 0.3 else "grey"
    name = next(name for most, name in _HUES if hue <= most)
    if light < 0.4 and name == "orange":
        return "brown"
    return f"light {name}" if light > 0.75 else f"dark {name}" if light < 0.3 else name


def _listed(names: list[str], count: int) -> str:
    if count > len(names):
        names = [*names, "more"]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""


FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class PagePayload:
    """The content of a page: JSON data, see docs/architecture.md, and the arrays that it names."""

    data: dict[str, Any]
    blob: bytes = field(repr=False)

    def message(self) -> str:
        """One JSON text: the data, and under ``blob`` the arrays, deflated (zlib) and in base64."""
        return json.dumps({**self.data, "blob": packed(self.blob)}, separators=(",", ":"), allow_nan=False)


def beyond_pages(program: Program) -> bool:
    """Whether something in it reflects, which no page draws."""
    return program.stage is not None and bool(LAYOUTS[3].unpack(program.vectors).roughness.any())


def has_sky(program: Program) -> bool:
    """Whether light comes from everywhere, which takes seconds to make for a page."""
    return program.stage is not None and program.stage.sky is not None


def view_of(
    program: Program,
    *,
    title: str = "",
    source: Sequence[tuple[str, str]] = (),
    form: PageProgram | None = None,
    animation: Animation | None = None,
    draft: Detail | None = None,
) -> PagePayload:
    """The view of a Program of a shipped model, with names and texts of its files and the form of its scene.

    Without a form its numbers never change. In a ``draft`` light from everywhere is of less
    detail, and what reflects is matte. Raises `ProgramError` for other weights, or where no page can
    draw the model, `SceneError` for materials that none draws.
    """
    manifest, store = load_manifest(program.model), ArrayStore()
    if manifest.renderer not in ("framed", "solid"):
        raise ProgramError(f"model `{manifest.name}` draws whole pictures, which no page does")
    if not manifest.framed:
        raise ProgramError(f"model `{manifest.name}` has learned transformations, which no page draws")
    if beyond_pages(program) and not draft:
        rough = LAYOUTS[3].unpack(program.vectors).roughness.reshape(len(program), -1).any(1)
        place = written([place for place, there in zip(program.places, rough, strict=True) if there])
        fact = f"`glossy` or `metal`{place}, which no page draws"
        help = "draw a picture or a video of it"
        raise SceneError([Diagnostic("E0560", fact, None, help=help)])
    network, digest = load_arrays(program.model, program.weights)
    program.check_weights(digest)
    elements = (*form.shapes, *form.paints) if form else worn_of(program)
    albedo = network.material_codes @ network.albedo[:-1] + network.albedo[-1]
    geometries = [{"name": name, "kind": "learned"} for name in manifest.geometries]
    figures = manifest.measured.get("sets", {}).get(manifest.set)  # errors on the scenes of its own set
    measured = {} if figures is None else {"cap": manifest.measured.get("psnr_cap_db")}
    measured |= {} if figures is None else {key: figures[key] for key in ("scenes", "psnr", "flip")}
    about = {"name": manifest.name, "summary": manifest.summary, "weights": digest, "measured": measured}
    data: dict[str, Any] = {
        **{"format": FORMAT, "title": title, "canvas": program.canvas, "dimension": manifest.dimension},
        "model": about,
        "shapes": [*geometries, *shapes_of(elements, store)],
        "materials": [
            {"name": name, "albedo": row[:3].tolist(), "medium": float(row[3]) if len(row) > 3 else 0.0}
            for name, row in zip(manifest.materials, albedo.astype(np.float64), strict=True)
        ],
        "paints": paints_of(elements, store),
        "program": {
            "rows": rows_of(program, manifest, network.codes, network.material_codes),
            "stage": program.stage and stage_data(program.stage),
            "background": program.background,
            "samples": program.samples,
        },
        "form": form and form.data,
        "params": form.params if form else [],
        "fixed": form.fixed if form else [],
        "animation": form and animation and {**animation.model_dump(), "frames": animation.frames},
        "source": [{"name": name, "text": text} for name, text in source],
        "licences": [
            {"name": name, "text": credit}
            for name, element in {e.credited: e for e in elements if isinstance(e, Element)}.items()
            if (credit := credit_of([element]))
        ],
    }
    if isinstance(network, FramedArrays):
        data |= plane.shader(network, store)
    elif isinstance(network, SolidArrays):
        data |= solid.shader(network, store)
        if has_sky(program):
            try:
                with timed(network, program, patient=False):
                    data["around"] = volume(program, network, store, draft or FULL)
            except OutOfTime:
                data["around"] = volume(program, network, store, OPEN)
                warnings.warn("light that takes long: as if nothing stood in its way", stacklevel=2)
    data["alt"] = alternative(data)
    return PagePayload(data, store.bytes())


MOST_TITLE: Final = 200
_POLICY: Final = (
    "default-src 'none'; script-src '{loader}' '{code}'; style-src '{style}'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'"
)
_LIGHT: Final = (
    '<p class="hint">The light that comes from everywhere is that of the moment when this page was made: '
    "it does not follow what moves or changes.</p>"
)
_SLOT: Final = re.compile(r"\[\[(\w+)\]\]")
_COMMENT: Final = re.compile(r"^ *(?:/\*\*.*?\*/|//[^\n]*)\n", re.MULTILINE | re.DOTALL)


def page(view: PagePayload, *, still: bytes = b"", embedded: bool = False) -> str:
    """An HTML file that draws a view; nothing in it comes from elsewhere, and its policy allows nothing to.

    Args:
        still: a WebP for browsers without WebGL2 or JavaScript.
        embedded: leave out heading, sources and licences, for a frame in another page.
    """
    data = view.data
    width, height = data["canvas"]
    sizes = f":root{{--aspect:{width / height:.6f};--controls:{control_rows(view)}rem}}\n"
    style = sizes + web("controls.css") + web("page.css")
    code, loader = f"{_COMMENT.sub('', script())}\nopenPage();\n", web("loader.js")
    alt = escape(plain(data["alt"]))
    drawn = base64.b64encode(still).decode()
    image = '<i id="still"></i>'
    if still:
        image = f'<img id="still" src="data:image/webp;base64,{drawn}" alt="{alt}">'
    parts = {
        "policy": escape(_POLICY.format(loader=_digest(loader), code=_digest(code), style=_digest(style))),
        "version": escape(version("scenelang")),
        "title": escape(plain(data["title"])[:MOST_TITLE] or "scene"),
        "style": style,
        "kind": "embedded" if embedded else "whole",
        "still": image,
        "width": str(width),
        "height": str(height),
        "alt": alt,
        "model": about_model(data["model"]),
        "light": _LIGHT * ("around" in data),
        "view": packed(view.message().encode()),
        "code": packed(code.encode()),
        "loader": loader,
    }
    return _SLOT.sub(lambda slot: parts[slot[1]], web("page.html"))


def control_rows(view: PagePayload) -> int:
    """The approximate height of a view's controls, in rem."""
    data = view.data
    fixed = {one["name"] for one in data["fixed"]}
    live = [param for param in data["params"] if param["name"] not in fixed]
    labels = sum("label" in param for param in live)
    timeline, camera = bool(data["animation"]), bool(data["dimension"] == 3)
    return ceil(2.5 * len(live) + 1.5 * labels + 2 * len(fixed) + 3 * bool(live) + 3 * timeline + 6 * camera)


def plain(text: str) -> str:
    """A text with control characters, marks of direction among them, written out: ⟨U+202E⟩."""
    hidden = ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")
    return "".join(f"⟨U+{ord(c):04X}⟩" if unicodedata.category(c) in hidden else c for c in text)


def about_model(model: dict[str, Any]) -> str:
    """A sentence about a model, as HTML."""
    name, summary = (f"<bdi>{escape(plain(model[key]))}</bdi>" for key in ("name", "summary"))
    line = f"Drawn by the neural network {name} ({summary})"
    figures = model.get("measured") or {}
    if "flip" in figures:
        line += (
            f", which on {figures['scenes']} random scenes was {figures['psnr']:.1f} dB (PSNR, counted up to "
            f"{figures['cap']:g}) and {figures['flip']:.4f} (mean FLIP) from the exact picture"
        )
    return f"{line}."


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


PROGRAM: Final = ".safetensors"
STILL_SIDE: Final = {2: 960, 3: 480}
"""Pixels along the longer side of a still picture; solids take longer."""
_QUALITIES: Final = (80, 60, 40, 20)  # of WebP, until it has few enough bytes
_MOST_STILL: Final = 40_000  # bytes
_FRAME_PX: Final = (360, 640)  # width of a frame in a notebook, at least and at most
_MOST_TEXT: Final = 20_000  # of a Scene, whose text nobody wrote


def export(
    source: str | os.PathLike[str] | Scene | Program,
    out: str | os.PathLike[str],
    *,
    params: Mapping[str, Any] | None = None,
    size: tuple[int, int] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    title: str | None = None,
) -> None:
    """Write an HTML page that draws a scene in any browser with WebGL2 and asks for nothing else.

    Args:
        source: the file of a scene, whose params the page can change and whose animation it plays; or the
            file of a Program (.safetensors), a Scene or a Program, which do not change.
        out: the page.
        params: values for a file's params that the page starts from; as for `scenelang.load`.
        size: canvas in pixels instead of the scene's; the picture keeps its aspect.
        model: draw with this model instead of the one that the scene names.
        root: folder that imports cannot leave; by default the file's.
        title: of the page; by default the name of the file.

    Raises:
        SceneError: the scene has errors, or materials that no page draws.
        ProgramError: the file is not a Program, or no page can draw its model.
        RenderError: the model has no weights here.
        ValueError: an argument says something of a file where there is none, or of a scene where there is a
            Program.
        OSError: a file cannot be read, or the page cannot be written.
    """
    given: Source | Scene | Program
    path = None if isinstance(source, Scene | Program) else Path(source)
    if path is None or path.suffix == PROGRAM:
        if params or root is not None:
            raise ValueError("params and root are for files of scenes")
        given = source if isinstance(source, Scene | Program) else load_program(Path(source))
        if isinstance(given, Scene):
            given = (given if size is None else given.sized(size)).of_model(model)
        elif size is not None or model is not None:
            raise ValueError("size and model are for scenes; a program is compiled for its own")
    else:
        given = Source(path, params=params, model=model, root=root, size=size)
    name = "" if path is None else path.stem
    view, program = viewed(given, name if title is None else title)
    write_output(out, page(view, still=still(program)).encode())


def viewed(source: Source | Scene | Program, title: str) -> tuple[PagePayload, Program]:
    """The view of a scene or a Program, and the Program that it shows first; raises as `export`."""
    if isinstance(source, Program):
        return scene_view(source, None, None, title=title), source
    evaluation, scene = None, source if isinstance(source, Scene) else None
    if isinstance(source, Source):
        evaluation = source.evaluation(result := Diagnostics())
        if (scene := evaluation.run(0)[0]) is None or result.errors:
            raise SceneError(result)
    assert scene is not None
    program = compile_scene(scene)
    return scene_view(program, scene, evaluation, title=title), program


def scene_view(
    program: Program,
    scene: Scene | None,
    evaluation: Evaluation | None,
    *,
    title: str = "",
    draft: Detail | None = None,
) -> PagePayload:
    """The view of a compiled scene, None for a Program from a file; the evaluation is that of its text."""
    source: list[tuple[str, str]] = []
    form = None
    if evaluation is not None:
        form = form_of(evaluation, load_manifest(program.model), worn_of(program), draft=draft is not None)
        folder = os.path.dirname(evaluation.sources[0].name)
        for text in evaluation.sources:
            if not library.holds(text):  # a file outside the folder is shown without its path
                place = os.path.relpath(text.name, folder).replace(os.sep, "/")
                source.append((Path(text.name).name if place.startswith("../") else place, text.text))
    elif scene is not None and len(written := scene.to_nsg()) <= _MOST_TEXT:
        source = [(f"{title or 'scene'}.nsg", written)]
    animation = None if scene is None else scene.animation
    return view_of(program, title=title, source=source, form=form, animation=animation, draft=draft)


def still(program: Program) -> bytes:
    """A picture of a Program as WebP, large enough for its small parts."""
    side = STILL_SIDE[2 if program.stage is None else 3] / max(program.canvas)
    width, height = (max(1, round(side * length)) for length in program.canvas)
    return _packed(render(replace(program, canvas=(width, height))).to_pil())


def frame(value: Scene | Program, picture: Image) -> str:
    """The viewer of a Scene or a Program as HTML for a notebook, in a frame that may run scripts alone.

    Empty where no page can draw it, or not at once. Browsers that cannot draw it show ``picture``.
    """
    program, scene = (value, None) if isinstance(value, Program) else (compile_scene(value), value)
    if has_sky(program):
        return ""
    try:
        view = scene_view(program, scene, None)
    except (ProgramError, SceneError):
        return ""
    small = picture.to_pil().reduce(-(-max(program.canvas) // STILL_SIDE[2]))
    text = escape(page(view, still=_packed(small), embedded=True))
    width = max(_FRAME_PX[0], min(_FRAME_PX[1], program.canvas[0]))
    height = round(width * program.canvas[1] / program.canvas[0]) + 16 * control_rows(view)
    title = escape(plain(view.data["alt"]))
    return (
        f'<iframe sandbox="allow-scripts" title="{title}" srcdoc="{text}" '
        f'width="{width}" height="{height}" style="border: 0; max-width: 100%"></iframe>'
    )


def _packed(picture: PIL.Image.Image) -> bytes:
    for quality in _QUALITIES:
        data = io.BytesIO()
        picture.save(data, "WEBP", quality=quality, method=6)
        if data.tell() <= _MOST_STILL:
            break
    return data.getvalue()
