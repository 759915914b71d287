"""Words of languages nearby - OpenSCAD, POV-Ray, GLSL, JavaScript, Python - and what is written here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final


def _each_word(meanings: Mapping[str, str]) -> dict[str, str]:
    """A table by each of the words that share a meaning."""
    return {word: meaning for words, meaning in meanings.items() for word in words.split()}


_GRADIENTS: Final = "a gradient is a material: material linear { stop(0, #d33); stop(1, #33d); }, or radial"

_UNIT: Final = "glue the unit to the number: 30deg; what is computed is multiplied by 1deg"
FUNCTIONS: Final = _each_word(
    {
        "pow": "write a ^ b",
        "mod": "write a % b",
        "fmod": "write a % b, which takes the sign of b",
        "fract frac": "write x % 1",
        "length": "len counts items; for a norm write sqrt(v.x ^ 2 + v.y ^ 2)",
        "norm": "write sqrt(v.x ^ 2 + v.y ^ 2)",
        "distance": "write sqrt((a.x - b.x) ^ 2 + (a.y - b.y) ^ 2)",
        "dot": "write a.x * b.x + a.y * b.y",
        "normalize": "divide by sqrt(v.x ^ 2 + v.y ^ 2)",
        "atan": "write atan2(y, x)",
        "ln": "log is the natural logarithm",
        "log10": "write log(x) / log(10)",
        "log2": "write log(x) / log(2)",
        "cbrt": "write x ^ (1 / 3)",
        "sqr": "write x ^ 2",
        "exp2": "write 2 ^ x",
        "cot": "write 1 / tan(x)",
        "sec": "write 1 / cos(x)",
        "csc": "write 1 / sin(x)",
        "sinh": "write (exp(x) - exp(-x)) / 2",
        "cosh": "write (exp(x) + exp(-x)) / 2",
        "tanh": "write 1 - 2 / (exp(2 * x) + 1)",
        "square": "write x ^ 2",
        "lerp": "write mix(a, b, t)",
        "step": "write x < e ? 0 : 1",
        "sign": "write x < 0 ? -1 : x > 0 ? 1 : 0",
        "trunc": "write floor(x), or ceil(x) below 0",
        "int": "write floor(x)",
        "float": "write x",
        "saturate": "write clamp(x, 0, 1)",
        "random rands": "write rand(seed), from a to b mix(a, b, rand(seed))",
        "noise": "write rand(seed), or rand([seed, i]) for one of many",
        "range": "write 0..<n, a..<b or a..<b step s",
        "vec2 float2 point": "write [x, y]",
        "vec3": "write [x, y, z]; x -> [x, x, x]",
        "vec4": "write [x, y, z]; colours have no alpha",
        "float3": "write [x, y, z]",
        "rgba": "write rgb(r, g, b); colours have no alpha",
        "hsl": "write hsv(h, s, v)",
        "deg rad turn radians": _UNIT,
        "degrees": "divide by 1deg for a number of degrees",
        "gradient linear_gradient linearGradient radial_gradient radialGradient": _GRADIENTS,
        "concat": "vectors are not joined; write all items into one",
        "str": "strings are not put together",
    }
)
"""Functions, and what to write."""

MATERIALS: Final = _each_word(
    {
        "lambert lambertian matte plastic standard basic phong pbr": "diffuse",
        "fog mist smoke cloud volume medium gas": "volumetric",
        "plain solid unlit constant": "flat",
        "glossy metal metallic mirror chrome shiny glass specular": "nothing reflects: in space there is "
        "diffuse, which is matte, and volumetric, which is mist; in the plane flat",
        "linear_gradient lineargradient": "linear",
        "radial_gradient radialgradient": "radial",
        "gradient": _GRADIENTS,
    }
)
"""Materials under another name, and what there is instead of others."""

LIBRARIES: Final = ("Math", "math", "np", "numpy")
"""Prefixes of the names of functions and constants."""

VALUES: Final = _each_word(
    {
        "e": "write exp(1)",
        "phi": "write (1 + sqrt(5)) / 2",
        "scene": "objects are drawn where they stand: sphere { scale(0.5); }",
        "deg rad turn degrees radians": _UNIT,
    }
)
"""Constants, in small letters, and what to write."""

NAMES: Final = _each_word(
    {
        "pi": "PI",
        "tau": "TAU",
        "true yes": "true",
        "false no": "false",
        "null nil undef transparent": "none",
        "time itime": "t",
        "framecount": "frames",
    }
)
"""Values under another name, in small letters."""

COLOURS: Final = _each_word(
    {
        "black": "#000",
        "white": "#fff",
        "red": "#f00",
        "green": "#008000",
        "lime": "#0f0",
        "blue": "#00f",
        "yellow": "#ff0",
        "cyan": "#0ff",
        "magenta": "#f0f",
        "orange": "#ffa500",
        "pink": "#ffc0cb",
        "purple": "#800080",
        "brown": "#a52a2a",
        "gray grey": "#808080",
        "gold": "#ffd700",
    }
)
"""Colours by their names on the web."""

WORDS: Final = _each_word(
    {
        "ball": "sphere",
        "donut doughnut": "torus",
        "move shift position pos": "translate",
        "turn spin rotation": "rotate",
        "zoom": "scale",
        "multmatrix": "matrix",
        "swirl": "twirl",
        "curl": "bend",
        "colour fill tint pigment": "color",
        "greyscale desaturate": "grayscale",
        "intersection": "intersect",
        "difference minus": "subtract",
        "merge add join": "union",
        "blend smooth_union opsmoothunion smin": "smooth",
        "texture": "material",
        "size_px resolution viewport createcanvas size": "canvas",
        "animation": "animate",
        "light_source pointlight point_light spotlight sun lamp": "light",
        "perspectivecamera perspective look_at lookat": "camera",
        "plane floor": "ground",
        "sky sky_sphere skybox": "background",
        "elif elsif elseif": "else if",
    }
)
"""Words that head statements, under another name."""

STATEMENTS: Final = _each_word(
    {
        "children": "what is called has no children: put what it draws into its block",
        "blend smooth_union opsmoothunion smin": "it is called `smooth` here, as in smooth(k = 0.3) { … }",
        "plane": "in space the plane below is there without a word; ground(y = -1); moves it",
        "hull": "there is no hull; smooth { … } blends objects into each other",
        "minkowski": "there is no Minkowski sum; smooth { … } blends objects into each other",
        "linear_extrude rotate_extrude": "a 2D scene is not extruded",
        "mirror": "write scale(-1, 1);",
        "offset": "a move is translate(x, y); outlines are not offset",
        "size resize r radius diameter width height": "write scale(s) or scale(sx, sy), in factors",
        "x y cx cy left top": "write translate(x, y)",
        "stroke outline border strokewidth stroke_width nostroke": "objects have no outlines: a "
        "larger one behind makes one",
        "fill nofill": "colours stand in the block of an object: star { material flat { color(#d33); } }",
        "shadow shadows castshadow": "whatever is lit throws a shadow",
        "fog mist smoke": "mist is an object: sphere { material volumetric; }",
        "repeat loop times": "loops run over a range or a vector: for (i in 0..<n) { … }",
        "transform": "each transform is a statement: translate(0.5, 0); rotate(30deg);",
        "skew skewx": "write shear(xy = tan(20deg))",
        "translatex translate_x movex": "write translate(x, 0)",
        "translatey translate_y movey": "write translate(0, y)",
        "translatez translate_z movez": "in space write translate(0, 0, z)",
        "scalex scale_x": "write scale(x, 1), in space scale(x, 1, 1)",
        "scaley scale_y": "write scale(1, y), in space scale(1, y, 1)",
        "scalez scale_z": "in space write scale(1, 1, z)",
        "fillet round bevel chamfer": "smooth(k = 0.1) { … } rounds where objects meet, "
        "subtract(k = 0.1) { … } the edge of a cut",
        "gradient linear_gradient radial_gradient": _GRADIENTS,
        "text": "no model draws text",
        "echo print": "nothing is printed while a scene is made",
        "return": "a function is one expression: fn f(x) = x ^ 2;",
        "while": "loops run over a range or a vector: for (i in 0..<n) { … }",
        "alpha": "write opacity(a) in a material's block; in 3D `volumetric` is translucent",
        "rotatex rotate_x rotx": "write rotate(90deg, axis = X);",
        "rotatey rotate_y roty": "write rotate(90deg, axis = Y);",
        "rotatez rotate_z rotz": "write rotate(90deg);",
        "ambient ambient_light ambientlight": "ambient light is the same in every scene",
        "density extinction absorption": "media all take light at one rate, 3 per world unit",
        "roughness metallic metalness shininess specular reflection": "solids are matte",
    }
)
"""Statements that are built otherwise."""

_COLOUR: Final = {"colour": "color"}
ARGUMENTS: Final = {
    "camera": _each_word(
        {
            "location position pos from origin look_from lookfrom": "eye",
            "look_at lookat to at center centre": "target",
            "angle fovy": "fov",
        }
    ),
    "light": _COLOUR
    | _each_word({"location pos at from": "position", "intensity strength energy brightness": "power"}),
    "ground": _COLOUR | _each_word({"height level": "y"}),
    "canvas": {"width": "w", "height": "h"},
    "subtract": _each_word({"radius r width": "k"}),
    "intersect": _each_word({"radius r width": "k"}),
    "smooth": _each_word({"radius r width": "k"}),
    "animate": _each_word({"duration length time": "seconds", "rate framerate frame_rate": "fps"}),
}
"""Arguments of statements, under another name."""

LOOKS: Final = ("color", "colour", "fill", "stroke", "material", "c")
"""Arguments that elsewhere give an object its colour."""


SHAPES: Final = _each_word(
    {
        "circle disc disk dot": "disc(r)",
        "ellipse oval": "ellipse(rx, ry)",
        "ring annulus": "ring(r, width)",
        "rect rectangle box quad": "rect(w, h)",
        "rounded rounded_rect rounded_rectangle roundrect rrect": "rounded(w, h, r)",
        "line segment": "line([x, y], [x, y], width)",
        "capsule stadium": "capsule([x, y], [x, y], width)",
        "path polyline": "path([[x, y], [x, y], …], width)",
        "polygon ngon": "polygon(n, r), which is regular",
        "pie sector wedge": "pie(r, 0deg, 90deg)",
        "arrow": "arrow([x, y], [x, y], width)",
        "arc": "arc(r, width, 0deg, 90deg)",
        "parallelogram": "parallelogram(p, a, b)",
        "hexagon": "polygon(6)",
        "heptagon": "polygon(7)",
        "octagon": "polygon(8)",
    }
)
"""Shapes by names in small letters: how the module of ``std/shapes`` is called."""
