"""After `fold_looks` the look of a constant material is one colour; objects that share a look still do."""

from __future__ import annotations

import scenelang as nsg
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.looks import Look, colour_steps, coloured
from scenelang.graph.lower import lower
from scenelang.graph.nodes import leaves
from scenelang.graph.verify import Invariant, verify
from scenelang.models.manifest import load_manifest
from scenelang.passes.context import Context
from scenelang.passes.leaves import fold_looks

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
