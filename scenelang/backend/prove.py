"""Pictures with a proof in one call: `scenelang.prove`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Unpack

from scenelang.backend.options import How, Options, RenderError, keep_memory
from scenelang.outputs import Proof
from scenelang.scene.schema import Scene

if TYPE_CHECKING:
    from scenelang.graph.nodes import Graph
    from scenelang.image import Image


def prove(
    scene: Scene | str | os.PathLike[str],
    image: Image | None = None,
    *,
    redraw: bool = False,
    size: tuple[int, int] | None = None,
    **how: Unpack[Options],
) -> tuple[Image, Proof]:
    """Draw a Scene of the plane, and prove how far each pixel is from the exact picture at most.

    Args:
        scene: what to draw, or the path of it, which is read as by `scenelang.load`.
        image: its picture, whoever drew it; by default it is drawn by the network, as `render` does.
        redraw: draw pixels again that are not proved right to 1/255. Then all are, but where an element may
            be seen, and where a sample lies on an outline to the last digits.
        size, **how: as for `render`; the backend is the network.

    Returns:
        The picture, and bounds of its pixels.

    Raises:
        SceneError: the Scene cannot be compiled.
        RenderError: nothing is proved of such pictures (solids, models with a learned lifting), the picture
            is of another size, or it cannot be drawn.
    """
    from scenelang.backend.render import draw
    from scenelang.diagnostics.diagnostic import Diagnostics
    from scenelang.evaluate.evaluation import opened
    from scenelang.program.compile import compile_scene

    way = How(**how).checked()
    if way.backend != "neural":
        raise RenderError(f"a proof is of what the network draws, and backend {way.backend} is exact")
    graphs: dict[str, Graph] = {}
    found = Diagnostics()
    scene, spans = opened(scene, found, size)
    program = compile_scene(scene, spans=spans, diagnostics=found, after=graphs.__setitem__)

    return prove_drawn(
        graphs, program.model, lambda: draw(program, way).image if image is None else image, redraw
    )


def prove_drawn(
    graphs: Mapping[str, Graph], model: str, draw: Callable[[], Image], redraw: bool
) -> tuple[Image, Proof]:
    """A picture and its proof, by the graphs after `lower` and each pass; raises as `prove`, before drawing.

    The stream that is proved has all objects, so that no pass that drops some has to be believed.
    """
    from scenelang.models.manifest import load_manifest
    from scenelang.models.weights import ModelError
    from scenelang.proof.picture import ProofError, known_errors, prove_image

    keep_memory()
    try:
        known_errors(manifest := load_manifest(model))
        return prove_image(graphs["lower"], graphs["flatten"], manifest, draw(), redraw=redraw)
    except (ProofError, ModelError) as error:
        raise RenderError(str(error)) from None
