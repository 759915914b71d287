"""Scenes of solids as POV-Ray 3.7 reads them, and its picture of them.

Spheres and tori under affine maps are its own, and so are boolean operations; what is warped, displaced or
blended is an isosurface of the definition's formula. Where its light differs, it is written so as to agree:

- its lights fade by 2 / (1 + (r/f)²): with f = 0.001 and a power of s/(2 f²) that is s/r², but for (f/r)²;
- ambient light of 0.12 + 0.06 n.y is its own 0.12 and two lights without shadows from far above and below,
  the lower one negative;
- it scatters (1, c) isotropically as c times what the light sends there, takes 3 of it per unit, and glows:
  so c is 3 C/4, and 3 · 0.12 C the glow.

It is drawn at twice the canvas, a sample a pixel, as linear numbers of 16 bits at a quarter of the light.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from math import tan
from pathlib import Path
from typing import Any

import numpy as np

from scenelang.compiler.graph import Fold, Leaf
from scenelang.compiler.spaces import Stage
from scenelang.compiler.steps import Affine, Displace, Step, Twist, Warp

FADE = 1e-3
GAP = 2e-3
DIM = 0.25  # numbers in the file are this share of the light's
OPTIONS = "-D", "-P", "-V", "-GA", "All_Console=off", "Dither=off", "File_Gamma=1.0", "-UR", "-UV", "+WT1"
OPTIONS += "-A", "+FP16", "+Iscene.pov", "+Oscene.ppm"

HEAD = f"""#version 3.7;
global_settings {{ assumed_gamma 1.0 max_trace_level 100 adc_bailout 1e-6 }}
#default {{ finish {{ ambient {0.12 * DIM} diffuse 1 }} }}
#macro Side(Way, Power) light_source {{
  Way * 1e5 rgb Power parallel point_at <0, 0, 0> shadowless media_interaction off }}
#end
Side(y, {0.06 * DIM})
Side(-y, {-0.06 * DIM})
"""


def povray() -> str | None:
    """The program, if it is installed."""
    return shutil.which("povray")


def numbers(values: Iterable[float]) -> str:
    return "<{}>".format(", ".join(f"{v:.17g}" for v in values))


def rgb(values: Iterable[float], factor: float = 1.0) -> str:
    return "rgb " + numbers(factor * v for v in values)


# ---------------------------------------------------------------- shapes


MESHES: dict[str, str] = {}  # shapes of other geometries


def mesh(vertices: np.ndarray, triangles: np.ndarray) -> str:
    """A closed mesh, without what ends it."""
    corners, faces = ", ".join(map(numbers, vertices)), ", ".join(map(numbers, triangles))
    return (
        f"mesh2 {{ vertex_vectors {{ {len(vertices)}, {corners} }} "
        f"face_indices {{ {len(triangles)}, {faces} }} inside_vector <0.3, 1, 0.2>"
    )


def primitive(leaf: Leaf, more: float = 0.0) -> str:
    """A leaf under affine maps, larger all around by so much of its own space."""
    steps: Any = leaf.steps
    maps = [np.reshape(step.rows, (3, 4)).T.ravel() for step in steps]
    if leaf.geometry in MESHES:
        return " ".join([MESHES[leaf.geometry], *(f"matrix {numbers(rows)}" for rows in maps), "}"])
    core = f"sphere {{ 0, {1 + more}" if leaf.geometry == "sphere" else f"torus {{ 0.7, {0.3 + more} sturm"
    return " ".join([core, *(f"matrix {numbers(rows)}" for rows in maps), "}"])


class PovrayFunctions:
    """Functions that are declared as they are asked for."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def declare(self, text: str) -> str:
        """The name of a new function of x, y and z."""
        self.lines.append(f"#declare F{len(self.lines)} = function(x, y, z) {{ {text} }}")
        return f"F{len(self.lines) - 1}"

    def turned(self, inner: str, angle: str, other: str) -> str:
        """What is behind a turn of x and another axis by an angle."""
        a = self.declare(angle)
        first = f"cos({a}(x, y, z)) * x + sin({a}(x, y, z)) * {other}"
        second = f"-sin({a}(x, y, z)) * x + cos({a}(x, y, z)) * {other}"
        return self.declare(f"{inner}({first}, {f'{second}, z' if other == 'y' else f'y, {second}'})")

    def leaf(self, leaf: Leaf, steps: Iterable[Step]) -> str:
        """The world distance to a leaf."""
        ball = "sqrt(x*x + y*y + z*z) - 1"
        at = self.declare(
            ball if leaf.geometry == "sphere" else "sqrt(pow(sqrt(x*x + z*z) - 0.7, 2) + y*y) - 0.3"
        )
        whole = np.eye(3)
        for step in steps:
            if isinstance(step, Affine):
                matrix = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)])
                whole = matrix[:3, :3] @ whole
                rows = [
                    f"{a:.17g}*x + {b:.17g}*y + {c:.17g}*z + {d:.17g}" for a, b, c, d in np.linalg.inv(matrix)
                ]
                at = self.declare(f"{at}({', '.join(rows[:3])})")
            elif isinstance(step, Displace):
                waves = " * ".join(f"sin({step.frequency:.17g} * {axis})" for axis in "xyz")
                at = self.declare(f"{at}(x, y, z) + {step.amount:.17g} * {waves}")
            elif isinstance(step, Twist):
                at = self.turned(at, f"{step.twist:.17g} * y", "z")
            elif isinstance(step, Warp):
                slopes = f"{step.bend[0]:.17g} * x + {step.bend[1]:.17g} * y"
                at = self.turned(at, f"{step.twirl:.17g} * sqrt(x*x + y*y + z*z) + {slopes}", "y")
        return self.declare(f"{np.linalg.svd(whole)[1].min():.17g} * {at}(x, y, z)")

    def blended(self, a: str, b: str, k: float) -> str:
        """The distance behind a blend."""
        h = self.declare(f"min(1, max(0, 0.5 + 0.5 * ({a}(x, y, z) - {b}(x, y, z)) / {k:.17g}))")
        mix = f"{a}(x, y, z) + ({b}(x, y, z) - {a}(x, y, z)) * {h}(x, y, z)"
        return self.declare(f"{mix} - {k:.17g} * {h}(x, y, z) * (1 - {h}(x, y, z))")


def isosurface(name: str) -> str:
    """Where a function is under 0, no farther than 2 from the origin."""
    return (
        f"isosurface {{ function {{ {name}(x, y, z) }} contained_by {{ sphere {{ 0, 2 }} }}"
        " accuracy 1e-5 max_gradient 2.5 all_intersections }"
    )


def joined(word: str, *shapes: str) -> str:
    return f"{word} {{ {' '.join(shapes)} }}"


def cells(root: Fold, formulas: PovrayFunctions) -> list[tuple[str, Leaf]]:
    """Shapes that do not overlap, each with the leaf that has its look: a chain of leaves, folded.

    A later object is cut out of those before it; a medium with a gap, as a ray would meet one of two surfaces
    in one place. Solids and media may not overlap. Blends join one shape to one, of one look.
    """
    found: list[tuple[str, Leaf]] = []
    distance = ""
    for link in root.links:
        leaf: Any = link.node
        steps = leaf.steps
        if link.op == "smooth":
            distance = formulas.blended(distance, formulas.leaf(leaf, steps), link.width)
            found = [(isosurface(distance), found[0][1])]
            continue
        if all(isinstance(step, Affine) for step in steps):
            shape, cutter = (
                primitive(leaf),
                primitive(leaf, GAP if leaf.look.material == "volumetric" else 0.0),
            )
        else:
            shape = cutter = isosurface(formulas.leaf(leaf, steps))
        if not found:
            distance = formulas.leaf(leaf, steps)
        word = "intersection" if link.op == "intersect" else "difference"
        found = [(joined(word, other, cutter), look) for other, look in found]
        if link.op == "union":
            found.append((shape, leaf))
    return found


def body(shape: str, leaf: Leaf) -> str:
    """A shape with its look, in linear colours."""
    colour = leaf.look.colour()
    if leaf.look.material == "diffuse":
        return f"object {{ {shape} pigment {{ {rgb(colour)} }} }}"
    return f"""object {{ {shape} hollow pigment {{ rgbt 1 }} finish {{ ambient 0 diffuse 0 }}
  interior {{ media {{ method 2 intervals 1 samples 40 jitter 0
  absorption 3 emission {rgb(colour, 3 * 0.12 * DIM)}
  scattering {{ 1, {rgb(colour, 3 / 4)} extinction 0 }} }} }} }}"""


# ---------------------------------------------------------------- the stage


def staged(stage: Stage, canvas: tuple[int, int]) -> str:
    """Camera, light, ground and sky."""
    camera, light, ground = stage.camera, stage.lights[0], stage.ground
    eye, target = np.array(camera.eye), np.array(camera.target)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    across, along = (2.0 * side / min(canvas) for side in canvas)
    glow = "finish { ambient 0 diffuse 0 emission 1 }"
    sky = [rgb(stage.horizon, DIM), rgb(stage.zenith, DIM)]
    parts = [
        f"camera {{ perspective location {numbers(eye)}"
        f" direction {numbers(forward / tan(camera.fov_rad / 2))}"
        f" right {numbers(across * right)} up {numbers(along * np.cross(right, forward))} }}",
        f"light_source {{ {numbers(light.position)} {rgb(light.rgb, DIM * light.power / (2 * FADE**2))}"
        f" fade_distance {FADE} fade_power 2 media_attenuation on }}",
        f"sky_sphere {{ pigment {{ function {{ min(0.999999, max(0, y / 0.5)) }}"
        f" color_map {{ [0 {sky[0]}] [1 {sky[1]}] }} }} }}",
    ]
    if ground is not None:
        parts.append(
            f"plane {{ y, {ground.y} no_shadow texture {{ function {{ exp(-(x*x + z*z) / 64) }}"
            f" texture_map {{ [0 pigment {{ {sky[0]} }} {glow}] [1 pigment {{ {rgb(ground.rgb)} }}] }} }} }}"
        )
    return "\n".join(parts)


def exported(root: Fold, stage: Stage, canvas: tuple[int, int]) -> str:
    """A scene in POV-Ray's language."""
    formulas = PovrayFunctions()
    bodies = [body(shape, leaf) for shape, leaf in cells(root, formulas)]
    return "\n".join([HEAD, *formulas.lines, staged(stage, canvas), *bodies, ""])


def traced(scene: str, canvas: tuple[int, int], *options: str) -> np.ndarray:
    """Linear light (H, W, 3) by POV-Ray, a sample a pixel unless options differ; RuntimeError if it fails."""
    width, height = canvas
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "scene.pov").write_text(scene)
        command = [str(povray()), *OPTIONS, f"+W{width}", f"+H{height}", *options]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr)
        data = Path(folder, "scene.ppm").read_bytes()
    linear = np.frombuffer(data[-width * height * 6 :], ">u2").astype(np.float64) / 65535 / DIM
    return linear.reshape(height, width, 3)


def povray_picture(root: Fold, stage: Stage, canvas: tuple[int, int]) -> np.ndarray:
    """Linear light (H, W, 3), four samples a pixel."""
    width, height = canvas
    drawn = traced(exported(root, stage, canvas), (2 * width, 2 * height))
    return np.asarray(drawn.reshape(height, 2, width, 2, 3).mean((1, 3)))
