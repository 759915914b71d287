"""After `fold_looks` the look of a constant material is one colour; objects that share a look still do."""

from __future__ import annotations

import scenelang as nsg
from scenelang.compiler.graph import Invariant, Look, colour_steps, coloured, leaves, verify
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.rewrites import Context, fold_looks
from scenelang.language.diagnostics import Diagnostics

SCENE = """
let red = material flat { rotate(30deg); color(#d33); hue(0.1turn); };
group { star { } square { } red; }
pentagon { }
"""


def test_looks_become_one_colour() -> None:
    manifest, diagnostics = load_manifest("shapes2d"), Diagnostics()
    scene = nsg.loads(SCENE)
    graph = fold_looks(lower(scene, manifest, None, diagnostics), Context(manifest, diagnostics))
    verify(graph, "fold_looks", {Invariant.LOOKS})
    star, square, pentagon = leaves(graph.root)
    assert star.look == Look("flat", rgb=coloured(colour_steps(scene.nodes[0].material.ops)))  # type: ignore[union-attr]
    assert star.look is square.look
    assert pentagon.look == Look("flat")
