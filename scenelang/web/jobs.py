"""Jobs of a process for the page: views, pictures, figures and files, of texts that may not be saved.

A job is JSON data: ``do`` (one of `DO`), ``path`` and ``name`` of the scene, its ``text``, ``texts`` of
others by their paths, ``root``, ``params``, ``frame``, ``size``, ``message``, to which the result is added,
and for a file an empty ``folder``.
"""

from __future__ import annotations

import base64
import io
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Graph, Leaf, nodes
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.how import How, RenderError
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import flip, over_white, psnr, side_by_side, ssim
from scenelang.drawing.render import draw, draw_exact
from scenelang.drawing.small import draw_small
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.reports import SceneError
from scenelang.output.animate import Progress, make
from scenelang.output.frames import Clip, Drawable, Shot, find_target, frame_key
from scenelang.output.painting import Painter
from scenelang.web.export import PagePayload, page, scene_view, still
from scenelang.web.folder import Answer, JobFailed
from scenelang.web.volume import DRAFT, OPEN

MOST_PIXELS: Final = 1 << 24
MOST_ROWS: Final = 5000
"""Objects of a scene that a page is given: so many take 1 MB and most of a second."""
MOST_LIT: Final = 200
"""Objects of a scene under a sky whose light a page is given a draft of."""
MOST_TOLD: Final = 100  # problems of a scene
_BY_NUMPY: Final = ("framed", "solid")  # renderers
_EXACT: dict[str, Image] = {}  # the last exact picture, by what it shows

Job = dict[str, Any]
Tell = Callable[[float], None]


def do(job: Job, tell: Tell) -> Answer:
    """Do a job, and report the share done; raises `JobFailed`."""
    try:
        return DO[job["do"]](job, tell)
    except SceneError as error:
        first = error.diagnostics[0].message if error.diagnostics else "the scene has errors"
        raise JobFailed(first) from None
    except (RenderError, ProgramError, ValueError) as error:
        raise JobFailed(str(error)) from None
    except FileNotFoundError as error:
        raise JobFailed(f"there is no file {error.filename}") from None


def warm() -> None:
    """Load what jobs would otherwise wait for."""
    job: Job = {"path": "a.nsg", "name": "", "texts": {}, "root": None}
    job |= {"params": {}, "frame": 0, "size": [32, 32]}
    for text in ("square;", "sphere;"):
        for kind in ("view", "network"):
            do({**job, "do": kind, "text": text, "message": {}}, lambda share: None)


def _view(job: Job, tell: Tell) -> Answer:
    """The scene for the page's own shader, and what is wrong with it."""
    started = time.perf_counter()
    result = Diagnostics()
    shown: PagePayload | None = None
    lacking: list[dict[str, Any]] = []
    evaluation = _source(job).evaluation(result)
    try:
        shown = _viewed(job, evaluation, result)[0]
    except SceneError as error:  # `result` has its diagnostics, but for those of pages
        result.items += [d for d in error.diagnostics if d not in result.items]
    except (ProgramError, FileNotFoundError) as error:
        problem = {"code": "", "severity": "warning", "message": str(error), "line": 1, "column": 1}
        lacking.append(problem)
    problems = [*map(_problem, result.items[:MOST_TOLD]), *lacking]
    data = {**job["message"], "view": shown and shown.message(), "problems": problems, "ms": _since(started)}
    head: dict[str, Any] = {"wanted": [str(path) for path in evaluation.wanted]}
    if shown is not None:
        head["lit"] = "around" in shown.data and len(shown.data["program"]["rows"]) <= MOST_LIT
        head["angles"] = [param["name"] for param in shown.data["params"] if param["kind"] == "angle"]
    return Answer(_json(data), head)


def _viewed(job: Job, evaluation: Evaluation, diagnostics: Diagnostics) -> tuple[PagePayload, Program]:
    scene, spans = evaluation.run(0)
    if scene is None or diagnostics.errors:
        raise SceneError(diagnostics)
    program = compile_scene(scene, spans=spans, diagnostics=diagnostics)
    if len(program) > MOST_ROWS:
        raise ProgramError(f"more than {MOST_ROWS:,} objects, which no page draws by itself")
    title, draft = Path(job["name"]).stem, {"view": OPEN, "light": DRAFT}.get(job["do"])
    return scene_view(program, scene, evaluation, title=title, draft=draft), program


def _problem(diagnostic: Diagnostic) -> dict[str, Any]:
    line, column = (1, 1) if diagnostic.span is None else diagnostic.span.locate()[0]
    here = {"code": diagnostic.code, "severity": diagnostic.severity, "message": diagnostic.message}
    return {**here, "line": line, "column": column}


def _network(job: Job, tell: Tell) -> Answer:
    image, ms = _draw(Clip(_source(job)), job["frame"])
    return _picture(job, image, ms)


def _reference(job: Job, tell: Tell) -> Answer:
    started = time.perf_counter()
    return _picture(job, _exact(job, Clip(_source(job))), {"draw": _since(started)})


def _difference(job: Job, tell: Tell) -> Answer:
    clip = Clip(_source(job))
    drawn, ms = _draw(clip, job["frame"])
    picture, exact = over_white(drawn), over_white(_exact(job, clip))
    figures = _figures_of(picture, exact)
    known = figures["flip"] is not None
    text = f"PSNR {figures['psnr']:.2f} dB" + (f"  FLIP {figures['flip']:.4f}" if known else "")
    return _picture(job, side_by_side(picture, exact, text, plain=not known), ms, **figures)


def _figures(job: Job, tell: Tell) -> Answer:
    started = time.perf_counter()
    clip = Clip(_source(job))
    shot = _shot(clip, job["frame"])
    graphs: dict[str, Graph] = {}
    program = compile_scene(shot.scene, spans=shot.spans, after=graphs.__setitem__)
    compiled = _since(started)
    drawn, ms = _draw(clip, job["frame"])
    started = time.perf_counter()
    exact = _exact(job, clip)
    data = {
        "model": program.model,
        "objects": sum(isinstance(node, Leaf) for node in nodes(graphs["lower"].root)),
        "rows": len(program),
        "canvas": program.canvas,
        "ms": {**ms, "compile": compiled, "exact": _since(started)},
        **_figures_of(over_white(drawn), over_white(exact)),
    }
    return Answer(_json({**job["message"], **data}))


def _figures_of(picture: np.ndarray, exact: np.ndarray) -> dict[str, float | None]:
    """PSNR, SSIM and FLIP; None where the package that measures it is missing."""
    result: dict[str, float | None] = {"psnr": round(psnr(picture, exact), 2)}
    for name, measure in (("ssim", ssim), ("flip", flip)):
        try:
            result[name] = round(measure(picture, exact), 5)
        except (ImportError, OSError):  # torch's libraries may not fit the memory
            result[name] = None
    return result


def _draw(clip: Clip, frame: int) -> tuple[Image, dict[str, float]]:
    """The network's picture of a frame, and milliseconds by stage."""
    started = time.perf_counter()
    program = clip.program(_shot(clip, frame))
    ms = {"compile": _since(started)}
    started = time.perf_counter()
    return _by_network(program), {**ms, "draw": _since(started)}


def _by_network(program: Program, tell: Tell | None = None) -> Image:
    _check_size(program.canvas)
    if load_manifest(program.model).renderer in _BY_NUMPY:
        return draw_small(program, progress=tell).image
    return draw(program, How(device="cpu", threads=1), progress=tell).image


def _exact(job: Job, clip: Clip) -> Image:
    """The exact picture; the last one is cached, for figures and differences."""
    shot = _shot(clip, job["frame"])
    _check_size(shot.scene.canvas)
    if (key := shot.scene.to_json()) not in _EXACT:
        image = draw_exact(shot.scene, spans=shot.spans)
        _EXACT.clear()
        _EXACT[key] = image
    return _EXACT[key]


def _picture(job: Job, image: Image, ms: dict[str, float], **facts: Any) -> Answer:
    started = time.perf_counter()
    data = io.BytesIO()
    image.to_pil().save(data, "PNG", compress_level=1)  # a third of the time for a tenth more bytes
    png = base64.b64encode(data.getvalue()).decode()
    size = [image.shape[1], image.shape[0]]
    facts = {**job["message"], "png": png, "size": size, "ms": {**ms, "encode": _since(started)}, **facts}
    return Answer(_json(facts))


class _ByNumpy(Painter):
    """Draws frames without torch, as single pictures are."""

    def prepare(self, shot: Shot) -> Drawable:
        program = self.clip.program(shot)
        if load_manifest(program.model).renderer not in _BY_NUMPY:
            return super().prepare(shot)
        return Drawable(shot.number, frame_key("play", program.digest()), shot, program, "numpy")


def _file(job: Job, tell: Tell) -> Answer:
    kind, clip = job["as"], Clip(_source(job))
    if kind == "png":
        return Answer(_by_network(clip.program(_shot(clip, job["frame"])), tell).encode())
    if kind == "html":
        result = Diagnostics()
        view, program = _viewed(job, _source(job).evaluation(result), result)
        return Answer(page(view, still=still(program)).encode())
    _check_size(clip.first.scene.canvas)

    def report(progress: Progress) -> None:
        share = progress.done / max(1.0, progress.total)
        tell(0.9 * share if progress.stage == "drawing" else 0.9 + 0.1 * share)

    target = find_target(str(Path(job["folder"], f"film.{kind}")), "film")
    rendered = make(_ByNumpy(clip), target, range(clip.frames), jobs=1, progress=report)
    return Answer(rendered.files[0].read_bytes())


def _source(job: Job) -> Source:
    return Source(
        job["path"],
        SourceFile(job["path"], job["text"]),
        params=job["params"],
        root=job["root"],
        size=job["size"] and tuple(job["size"]),
        texts={Path(path): text for path, text in job["texts"].items()},
    )


def _shot(clip: Clip, frame: int) -> Shot:
    """A frame, or the last one where the animation has become shorter."""
    return clip.first if frame == 0 else clip.shot(min(frame, clip.frames - 1))


def _check_size(canvas: tuple[int, int]) -> None:
    if canvas[0] * canvas[1] > MOST_PIXELS:
        size = f"{canvas[0]} × {canvas[1]}"
        raise JobFailed(f"a canvas of {size}; pictures have at most {MOST_PIXELS:,} pixels here")


def _json(data: dict[str, Any]) -> bytes:
    return json.dumps(data, separators=(",", ":"), allow_nan=False).encode()


def _since(started: float) -> float:
    return round(1000 * (time.perf_counter() - started), 2)


DO: Final[dict[str, Callable[[Job, Tell], Answer]]] = {
    "view": _view,
    "light": _view,
    "network": _network,
    "reference": _reference,
    "difference": _difference,
    "figures": _figures,
    "file": _file,
}
