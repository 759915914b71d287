"""A language for scene graphs and a compiler from it to neural render calls.

The pipeline, in order: ``syntax`` reads text into a tree, ``evaluate`` runs that to concrete nodes,
``graph`` lowers those, ``passes`` rewrite them, ``program`` makes vectors and tokens, ``renderers`` draw.

Importing this package imports nothing else; each name below is fetched when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from scenelang.animation.api import animate as animate
    from scenelang.animation.api import render_frames as render_frames
    from scenelang.animation.timing import FramesError as FramesError
    from scenelang.backend.options import RenderError as RenderError
    from scenelang.backend.outputs import render_outputs as render_outputs
    from scenelang.backend.prove import prove as prove
    from scenelang.backend.render import render as render
    from scenelang.diagnostics.diagnostic import Diagnostic as Diagnostic
    from scenelang.diagnostics.diagnostic import Diagnostics as Diagnostics
    from scenelang.diagnostics.error import SceneError as SceneError
    from scenelang.evaluate.evaluation import load as load
    from scenelang.evaluate.evaluation import loads as loads
    from scenelang.fitting.api import FitError as FitError
    from scenelang.fitting.api import learn as learn
    from scenelang.formatting.format import format_text as format_text
    from scenelang.image import Image as Image
    from scenelang.inverse.api import fit as fit
    from scenelang.inverse.fitted import Fit as Fit
    from scenelang.measure.metrics import compare as compare
    from scenelang.notebook import set_notebook as set_notebook
    from scenelang.outputs import Outputs as Outputs
    from scenelang.outputs import Proof as Proof
    from scenelang.program.check import check as check
    from scenelang.program.check import check_text as check_text
    from scenelang.program.check import fix_text as fix_text
    from scenelang.program.compile import compile as compile
    from scenelang.program.program import Place as Place
    from scenelang.program.program import Program as Program
    from scenelang.program.program import ProgramError as ProgramError
    from scenelang.program.reading import load_program as load_program
    from scenelang.scene.schema import Animation as Animation
    from scenelang.scene.schema import Bend as Bend
    from scenelang.scene.schema import Boolean as Boolean
    from scenelang.scene.schema import Camera as Camera
    from scenelang.scene.schema import Chain as Chain
    from scenelang.scene.schema import Color as Color
    from scenelang.scene.schema import Displace as Displace
    from scenelang.scene.schema import Elements as Elements
    from scenelang.scene.schema import Flip as Flip
    from scenelang.scene.schema import Grayscale as Grayscale
    from scenelang.scene.schema import Ground as Ground
    from scenelang.scene.schema import Group as Group
    from scenelang.scene.schema import Hue as Hue
    from scenelang.scene.schema import Light as Light
    from scenelang.scene.schema import Link as Link
    from scenelang.scene.schema import Material as Material
    from scenelang.scene.schema import Matrix as Matrix
    from scenelang.scene.schema import Object as Object
    from scenelang.scene.schema import Rotate as Rotate
    from scenelang.scene.schema import Scale as Scale
    from scenelang.scene.schema import Scene as Scene
    from scenelang.scene.schema import Shear as Shear
    from scenelang.scene.schema import Translate as Translate
    from scenelang.scene.schema import Twirl as Twirl
    from scenelang.scene.schema import Twist as Twist
    from scenelang.scene.schema import load_elements as load_elements
    from scenelang.sweep.api import render_many as render_many
    from scenelang.viewer.export import export as export

# Module -> public names it defines. A new public name is added here and above.
_HOME: Final = {
    "scenelang.animation.api": "animate render_frames",
    "scenelang.animation.timing": "FramesError",
    "scenelang.backend.options": "RenderError",
    "scenelang.backend.outputs": "render_outputs",
    "scenelang.backend.prove": "prove",
    "scenelang.backend.render": "render",
    "scenelang.notebook": "set_notebook",
    "scenelang.outputs": "Outputs Proof",
    "scenelang.diagnostics.diagnostic": "Diagnostic Diagnostics",
    "scenelang.diagnostics.error": "SceneError",
    "scenelang.evaluate.evaluation": "load loads",
    "scenelang.fitting.api": "FitError learn",
    "scenelang.formatting.format": "format_text",
    "scenelang.image": "Image",
    "scenelang.inverse.api": "fit",
    "scenelang.inverse.fitted": "Fit",
    "scenelang.measure.metrics": "compare",
    "scenelang.program.check": "check check_text fix_text",
    "scenelang.program.compile": "compile",
    "scenelang.program.program": "Place Program ProgramError",
    "scenelang.program.reading": "load_program",
    "scenelang.scene.schema": (
        "Animation Bend Boolean Camera Chain Color Displace Elements Flip Grayscale Ground Group Hue Light "
        "Link Material Matrix Object Rotate Scale Scene Shear Translate Twirl Twist load_elements"
    ),
    "scenelang.sweep.api": "render_many",
    "scenelang.viewer.export": "export",
}
_MODULE: Final = {name: module for module, names in _HOME.items() for name in names.split()}

__all__ = sorted(_MODULE)


def __getattr__(name: str) -> Any:
    if name not in _MODULE:
        raise AttributeError(f"module 'scenelang' has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULE[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
