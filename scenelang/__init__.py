"""A language for scene graphs and a compiler from it to neural render calls.

The pipeline, in order: ``language`` reads text and evaluates it to a Scene, ``compiler`` lowers that to a
graph, rewrites it and lifts it to the vectors and tokens of a Program, ``drawing`` draws.

Importing this package imports nothing else; each name below is fetched when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from scenelang.compiler.check import check as check
    from scenelang.compiler.check import check_text as check_text
    from scenelang.compiler.check import fix_text as fix_text
    from scenelang.compiler.compile import compile as compile
    from scenelang.compiler.program import Place as Place
    from scenelang.compiler.program import Program as Program
    from scenelang.compiler.program import ProgramError as ProgramError
    from scenelang.compiler.program import load_program as load_program
    from scenelang.drawing.how import RenderError as RenderError
    from scenelang.drawing.image import Image as Image
    from scenelang.drawing.image import Outputs as Outputs
    from scenelang.drawing.image import Proof as Proof
    from scenelang.drawing.metrics import compare as compare
    from scenelang.drawing.render import prove as prove
    from scenelang.drawing.render import render as render
    from scenelang.drawing.render import render_outputs as render_outputs
    from scenelang.inverse.fit import Fit as Fit
    from scenelang.inverse.fit import fit as fit
    from scenelang.inverse.learn import FitError as FitError
    from scenelang.inverse.learn import learn as learn
    from scenelang.language.diagnostics import Diagnostic as Diagnostic
    from scenelang.language.diagnostics import Diagnostics as Diagnostics
    from scenelang.language.evaluation import load as load
    from scenelang.language.evaluation import loads as loads
    from scenelang.language.formatting import format_text as format_text
    from scenelang.language.nodes import Animation as Animation
    from scenelang.language.nodes import Bend as Bend
    from scenelang.language.nodes import Boolean as Boolean
    from scenelang.language.nodes import Camera as Camera
    from scenelang.language.nodes import Chain as Chain
    from scenelang.language.nodes import Color as Color
    from scenelang.language.nodes import Displace as Displace
    from scenelang.language.nodes import Flip as Flip
    from scenelang.language.nodes import Grayscale as Grayscale
    from scenelang.language.nodes import Ground as Ground
    from scenelang.language.nodes import Group as Group
    from scenelang.language.nodes import Grow as Grow
    from scenelang.language.nodes import Hue as Hue
    from scenelang.language.nodes import Light as Light
    from scenelang.language.nodes import Link as Link
    from scenelang.language.nodes import Material as Material
    from scenelang.language.nodes import Matrix as Matrix
    from scenelang.language.nodes import Object as Object
    from scenelang.language.nodes import Rotate as Rotate
    from scenelang.language.nodes import Scale as Scale
    from scenelang.language.nodes import Shear as Shear
    from scenelang.language.nodes import Shell as Shell
    from scenelang.language.nodes import Stop as Stop
    from scenelang.language.nodes import Translate as Translate
    from scenelang.language.nodes import Twirl as Twirl
    from scenelang.language.nodes import Twist as Twist
    from scenelang.language.reports import SceneError as SceneError
    from scenelang.language.scene import Elements as Elements
    from scenelang.language.scene import Scene as Scene
    from scenelang.language.scene import load_elements as load_elements
    from scenelang.output.animate import animate as animate
    from scenelang.output.animate import render_frames as render_frames
    from scenelang.output.frames import FramesError as FramesError
    from scenelang.output.mesh import TriangleMesh as TriangleMesh
    from scenelang.output.shapes import to_mesh as to_mesh
    from scenelang.output.shapes import to_svg as to_svg
    from scenelang.output.sweep import render_many as render_many
    from scenelang.web.export import export as export
    from scenelang.web.notebook import set_notebook as set_notebook


# Module -> public names it defines. A new public name is added here and above.
_HOME: Final = {
    "scenelang.compiler.check": "check check_text fix_text",
    "scenelang.compiler.compile": "compile",
    "scenelang.compiler.program": "load_program Place Program ProgramError",
    "scenelang.drawing.how": "RenderError",
    "scenelang.drawing.image": "Image Outputs Proof",
    "scenelang.drawing.metrics": "compare",
    "scenelang.drawing.render": "prove render render_outputs",
    "scenelang.inverse.fit": "fit Fit",
    "scenelang.inverse.learn": "FitError learn",
    "scenelang.language.diagnostics": "Diagnostic Diagnostics",
    "scenelang.language.evaluation": "load loads",
    "scenelang.language.formatting": "format_text",
    "scenelang.language.nodes": (
        "Animation Bend Boolean Camera Chain Color Displace Flip Grayscale Ground Group Grow Hue Light Link "
        "Material Matrix Object Rotate Scale Shear Shell Stop Translate Twirl Twist"
    ),
    "scenelang.language.reports": "SceneError",
    "scenelang.language.scene": "Elements load_elements Scene",
    "scenelang.output.animate": "animate render_frames",
    "scenelang.output.frames": "FramesError",
    "scenelang.output.mesh": "TriangleMesh",
    "scenelang.output.shapes": "to_mesh to_svg",
    "scenelang.output.sweep": "render_many",
    "scenelang.web.export": "export",
    "scenelang.web.notebook": "set_notebook",
}
_MODULE: Final = {name: module for module, names in _HOME.items() for name in names.split()}

__all__ = sorted(_MODULE)


def _show(value: Any, canvas: tuple[int, int], said: str) -> dict[str, Any]:
    """Show a Scene or Program in a notebook."""
    from scenelang.web.notebook import bundle

    return bundle(value, canvas, said)


def __getattr__(name: str) -> Any:
    if name not in _MODULE:
        raise AttributeError(f"module 'scenelang' has no attribute {name!r}")
    from scenelang.assets import notebook

    notebook.show = _show
    value = getattr(importlib.import_module(_MODULE[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
