"""Scene to Program in one call. Imports numpy, never torch."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

from scenelang.diagnostics.diagnostic import Diagnostics, Label
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import listing
from scenelang.graph.lower import Memory, Spans
from scenelang.graph.nodes import Graph
from scenelang.models.choose import apart, best_of_sets, choose_model, lacking, shown, uses
from scenelang.models.manifest import Manifest, available, load_manifest
from scenelang.passes import check_scene
from scenelang.scene.schema import Scene

if TYPE_CHECKING:
    from scenelang.models.weights import Codes
    from scenelang.program.program import Program


def compile_scene(
    scene: Scene | str | os.PathLike[str],
    *,
    spans: Spans | None = None,
    diagnostics: Diagnostics | None = None,
    model: str | None = None,
    codes: Codes | None = None,
    after: Callable[[str, Graph], None] | None = None,
    without: Collection[str] = (),
    memory: Memory | None = None,
) -> Program:
    """Compile a scene for a model.

    Args:
        scene: a concrete scene, or the path of one, which is read as by `scenelang.load`.
        spans: where its nodes were written, for diagnostics and the source map; those of a file are known.
        diagnostics: collects errors and warnings.
        model: draw with this model instead of the one the scene names.
        codes: lift with these instead of the model's shipped ones, for weights under trial.
        after: called with ``"lower"`` and the name of each pass and the graph it left.
        without: names of passes to leave out, of those that only save work (`scenelang.passes.OPTIONAL`).
        memory: what the frame before left, of an animation whose frames share nodes; the same Program comes
            out with or without it.

    Returns:
        The Program; the same scene always gives the same one, byte for byte.

    Raises:
        SceneError: the scene cannot be compiled; it carries all diagnostics.
        FileNotFoundError: the model has no weights.
        OSError: the file cannot be opened.
        TypeError: neither a Scene nor a path.
    """
    found = diagnostics if diagnostics is not None else Diagnostics()
    if not isinstance(scene, Scene):
        from scenelang.evaluate.evaluation import opened

        scene, spans = opened(scene, found)
    manifest = find_model(scene, found, model=model, spans=spans)
    if manifest is not None:
        graph = check_scene(scene, spans, found, manifest, after, without, memory)
    if manifest is None or found.errors:
        raise SceneError(found)
    # Lifting is what needs numpy; scenes that are only checked or have errors never come this far.
    from scenelang.models.weights import load_codes
    from scenelang.program.emit import emit

    return emit(graph, manifest, codes or load_codes(manifest.name))


def find_model(
    scene: Scene, diagnostics: Diagnostics, *, model: str | None = None, spans: Spans | None = None
) -> Manifest | None:
    """The manifest a scene is compiled for: the one asked for, the one it names, or the smallest that fits.

    Where there is none, ``diagnostics`` receives E0210 or E0508.
    """
    name = model if model is not None else scene.model
    known = available()
    place = spans.span(scene) if spans is not None else None
    if name is not None:
        if name in known:
            return load_manifest(name)
        listed = ", ".join(f"`{k}`" for k in known)
        diagnostics.add("E0210", f"unknown model `{name}`", place, help=f"the models are {listed}")
        return None
    manifests = [load_manifest(k) for k in known]
    # Of what no model has or takes, one that has all else says what it lacks.
    fitting = choose_model(scene, manifests) or choose_model(scene, manifests, lenient=True)
    if fitting is not None:
        return fitting
    best = best_of_sets(manifests)
    if len(best) == 1:
        # Compiling for the only model there is says what exactly it lacks.
        return best[0]
    _no_model(scene, best, diagnostics, spans)
    return None


def _no_model(
    scene: Scene, manifests: Sequence[Manifest], diagnostics: Diagnostics, spans: Spans | None
) -> None:
    """Report that no model has all of a scene, at two names that are never together, and which is near."""
    used = list(uses(scene))
    nearest = min(manifests, key=lambda model: len(lacking(model, used)))
    help = f"`{nearest.name}` comes nearest; it lacks {listing(lacking(nearest, used))}"
    pair = apart(scene, manifests)
    if pair is None:
        fact = "no single model has every geometry, material and transform of the scene"
        diagnostics.add("E0508", fact, spans.span(scene) if spans is not None else None, help=help)
        return
    places = [spans.span(node) if spans is not None else None for _, _, node in pair]
    known = [
        " and ".join(f"`{m.name}`" for m in manifests if name in getattr(m, field)) for name, field, _ in pair
    ]
    labels = [Label(places[0], f"in {known[0] or 'no model'}")] if places[0] is not None else []
    one, other = (f"`{shown(use)}`" for use in pair)
    fact = f"no model has both {one} and {other}, which is in {known[1] or 'no model'}"
    spaces = [{m.dimension for m in manifests if not lacking(m, [use])} for use in pair]
    if spaces in ([{2}, {3}], [{3}, {2}]):
        kinds = ["solid" if space == {3} else "flat" for space in spaces]
        one, other = (
            f"`{place.text if place else shown(use)}`" for place, use in zip(places, pair, strict=True)
        )
        fact = f"{one} belongs to {kinds[0]} scenes, {other} to {kinds[1]} ones: a scene is flat or solid"
        labels = [Label(label.span, f"of {kinds[0]} scenes") for label in labels]
        help = f"leave out {other}" + (f" or {one}" if pair[1][1] in ("geometries", "elements") else "")
        if pair[1][1] == "looks":
            materials = {name for m in manifests if {m.dimension} == spaces[0] for name in m.materials}
            help = f"write material {' or '.join(sorted(materials))} in its place"
    diagnostics.add("E0508", fact, places[1], labels=labels, help=help)


compile = compile_scene
"""`scenelang.compile`."""
