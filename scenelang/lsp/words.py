"""The words of the language: how they are called and what they mean, for hover, completion and signatures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from scenelang.evaluate.values.functions import FUNCTIONS


@dataclass(frozen=True, slots=True)
class Word:
    """A word of the language.

    Args:
        head: how it is written, as in a reference.
        text: what it means, in Markdown.
        params: names of its arguments, in order; several forms of a call have those of the longest.
        about: a line for each argument.
        snippet: what completion inserts, with placeholders; empty for the word itself.
    """

    head: str
    text: str
    params: tuple[str, ...] = ()
    about: tuple[str, ...] = ()
    snippet: str = ""


def _w(head: str, text: str, params: str = "", about: tuple[str, ...] = (), snippet: str = "") -> Word:
    return Word(head, text, tuple(params.split()), about, snippet)


_ANGLE = "an angle, such as `30deg`, `0.5rad` or `0.25turn`"
_TURN = "R(a) turns a point clockwise by a, so what it draws turns counter-clockwise."

TRANSFORMS: Final[dict[str, Word]] = {
    "translate": _w(
        "translate(x, y[, z])",
        "Moves by a vector. A vector may stand for the components: `translate(at)`.",
        "x y z",
        ("along x", "along y", "along z, 0 by default"),
        "translate(${1:0}, ${2:0});",
    ),
    "rotate": _w(
        "rotate(angle[, axis = Z])",
        "Turns counter-clockwise about an axis through the origin.",
        "angle axis",
        (_ANGLE, "`X`, `Y`, `Z` or a vector; `Z` by default, the only one in 2D"),
        "rotate(${1:30}deg);",
    ),
    "scale": _w(
        "scale(s) or scale(sx, sy[, sz])",
        "Scales about the origin, evenly or along each axis. A factor of 0 is an error.",
        "sx sy sz",
        ("along x, or evenly where it is alone", "along y", "along z, 1 by default"),
        "scale(${1:0.5});",
    ),
    "shear": _w(
        "shear(xy = k)",
        "x grows by k·y; likewise `xz`, `yx`, `yz`, `zx`, `zy`. One term a call.",
        "xy xz yx yz zx zy",
        ("x += k·y", "x += k·z", "y += k·x", "y += k·z", "z += k·x", "z += k·y"),
        "shear(${1|xy,yx|} = ${2:0.5});",
    ),
    "matrix": _w(
        "matrix([[…4], […4], […4], […4]])",
        "An affine map by its rows, for column vectors; the last row is 0, 0, 0, 1.",
        "rows",
        ("four rows of four numbers",),
        "matrix([[${1:1}, 0, 0, ${2:0}], [0, ${3:1}, 0, ${4:0}], [0, 0, 1, 0], [0, 0, 0, 1]]);",
    ),
    "twirl": _w(
        "twirl(k)",
        "Turns each point by k times its distance from the origin: p → R(k·|p|) p on the way back. " + _TURN,
        "k",
        ("radians per unit length, a bare number",),
        "twirl(${1:1});",
    ),
    "bend": _w(
        "bend(k)",
        "Turns each point by k times its x: p → R(k·p.x) p on the way back. " + _TURN,
        "k",
        ("radians per unit length, a bare number",),
        "bend(${1:0.5});",
    ),
    "twist": _w(
        "twist(k)",
        "3D: turns (x, z) by k·y.",
        "k",
        ("radians per unit length, a bare number",),
        "twist(${1:1});",
    ),
    "displace": _w(
        "displace(amount, frequency)",
        "3D: adds amount · sin(f x) sin(f y) sin(f z) to the distance.",
        "amount frequency",
        ("how far", "f, radians per unit length"),
        "displace(${1:0.1}, ${2:8});",
    ),
}

OPERATIONS: Final[dict[str, Word]] = {
    **{name: TRANSFORMS[name] for name in ("translate", "rotate", "scale", "shear")},
    "flip": _w("flip()", "Mirrors the texture: x → −x.", snippet="flip();"),
    "color": _w(
        "color(c)",
        "Multiplies the material's colour.",
        "c",
        ("`#d33`, `[r, g, b]`, `rgb(r, g, b)` or `hsv(h, s, v)`",),
        "color(${1:#d33});",
    ),
    "grayscale": _w(
        "grayscale(a)",
        "Mixes with the luma 0.2126 R + 0.7152 G + 0.0722 B.",
        "a",
        ("0 keeps the colour, 1 is grey",),
        "grayscale(${1:1});",
    ),
    "hue": _w(
        "hue(angle)", "Shifts the hue, keeping S and V of HSV.", "angle", (_ANGLE,), "hue(${1:0.1}turn);"
    ),
}

SETTINGS: Final[dict[str, Word]] = {
    "canvas": _w(
        "canvas(w, h)",
        "The output size in pixels, 256 × 256 without it, at most 8192 a side. `--size` overrides it.",
        "w h",
        ("width in pixels", "height in pixels"),
        "canvas(${1:256}, ${2:256});",
    ),
    "background": _w(
        "background(c)",
        "2D: the colour where nothing is drawn, white without it; `background(none)` leaves it transparent.",
        "c",
        ("a colour, or `none`",),
        "background(${1:#fff});",
    ),
    "animate": _w(
        "animate(seconds, fps, loop = true)",
        "Makes `t`, `u`, `frame` and `frames` run.",
        "seconds fps loop",
        ("how long, such as `2s`", "frames a second", "whether the end joins the start"),
        "animate(seconds = ${1:2}, fps = ${2:24}, loop = ${3|true,false|});",
    ),
}

_SCALAR = {
    "sin": "The sine of an angle.",
    "cos": "The cosine of an angle.",
    "tan": "The tangent of an angle.",
    "asin": "The angle whose sine is x.",
    "acos": "The angle whose cosine is x.",
    "atan2": "The angle of the point (x, y), from the x axis.",
    "abs": "The absolute value of a number, an angle or a time.",
    "min": "The least of its arguments; of one vector the least item, of several componentwise.",
    "max": "The greatest of its arguments; of one vector the greatest item, of several componentwise.",
    "clamp": "x kept between low and high.",
    "floor": "The greatest whole number not above x.",
    "ceil": "The least whole number not below x.",
    "round": "The nearest whole number; halves away from zero.",
    "sqrt": "The square root.",
    "exp": "e to the x.",
    "log": "The natural logarithm.",
    "mix": "a (1 − t) + b t: numbers, angles, vectors, colours.",
    "smoothstep": "0 below low, 1 above high, 3t² − 2t³ between.",
    "len": "How many items a vector or range has, or characters a string.",
    "rand": "A number in [0, 1) that depends on the seed alone, the same on every machine.",
    "rgb": "A colour; components in 0..1.",
    "hsv": "A colour by hue (turns or an angle), saturation and value.",
}


def _function(name: str) -> Word:
    builtin = FUNCTIONS[name]
    params = builtin.params if not builtin.variadic else ("a", "…")
    shown = ", ".join(params)
    holes = ", ".join(f"${{{at}:{p}}}" for at, p in enumerate(builtin.params, 1))
    return Word(f"{name}({shown})", _SCALAR.get(name, ""), builtin.params, (), f"{name}({holes})")


FUNCTION_WORDS: Final[dict[str, Word]] = {name: _function(name) for name in FUNCTIONS}

CONSTANTS: Final[dict[str, Word]] = {
    "PI": _w("PI", "3.14159…, a number; half a turn is `0.5turn`."),
    "TAU": _w("TAU", "2π, a number."),
    "X": _w("X", "The x axis, `[1, 0, 0]`."),
    "Y": _w("Y", "The y axis, `[0, 1, 0]`."),
    "Z": _w("Z", "The z axis, `[0, 0, 1]`."),
    "none": _w("none", "No background: `background(none)`."),
}

ANIMATED: Final[dict[str, Word]] = {
    "t": _w("t", "The time of the frame in seconds; 0 without `animate`."),
    "u": _w("u", "How far the animation is, in [0, 1) for a loop; 0 without `animate`."),
    "frame": _w("frame", "The number of the frame, from 0."),
    "frames": _w("frames", "How many frames there are; 1 without `animate`."),
}

GEOMETRIES: Final[dict[str, str]] = {
    "square": "Corners on the unit circle: sides of √2, half a side is 0.707. "
    'For sides of your own, `import "std/shapes" as s;` and `s.rect(w, h)`.',
    "triangle": "Regular, circumradius 1, a vertex at +y.",
    "pentagon": "Regular, circumradius 1, a vertex at +y.",
    "star": "Five points, outer radius 1, inner radius 0.381966, a point at +y.",
    "sphere": "Radius 1.",
    "torus": "Radii 0.7 and 0.3, axis y.",
}

MATERIALS: Final[dict[str, str]] = {
    "flat": "A constant colour, white without `color`.",
    "diffuse": "Lambertian, lit by the model's point light.",
    "volumetric": "A medium that absorbs and scatters.",
}

KEYWORDS: Final[dict[str, Word]] = {
    "nsg": _w("nsg 1;", "The language version; the first statement.", snippet="nsg 1;"),
    "model": _w(
        'model "name";',
        "Render with this model; without it the smallest one that fits is taken.",
        snippet='model "$1";',
    ),
    "param": _w(
        "param NAME = expr [in range];",
        "An input with a default and a range; `-D NAME=value` sets it.",
        snippet="param ${1:name} = ${2:0.5} in ${3:0..1};",
    ),
    "let": _w("let NAME = expr;", "A name for a value, from its line on.", snippet="let ${1:name} = $2;"),
    "fn": _w("fn NAME(a, b = 1) = expr;", "A function.", snippet="fn ${1:name}(${2:x}) = $3;"),
    "module": _w(
        "module NAME(a, b = 1) { … }",
        "A piece of scene that is called like an object.",
        snippet="module ${1:name}(${2:at}) {\n\t$0\n}",
    ),
    "import": _w(
        'import "path.nsg" as NAME;',
        "Brings what another file defines, as `NAME.name`.",
        snippet='import "$1" as ${2:lib};',
    ),
    "for": _w(
        "for (i in range) { … }",
        "Repeats a block for each value of a range or a vector.",
        snippet="for (${1:i} in ${2:0..<4}) {\n\t$0\n}",
    ),
    "if": _w(
        "if (condition) { … } else { … }",
        "Takes one of two blocks.",
        snippet="if (${1:condition}) {\n\t$0\n}",
    ),
    "else": _w("else { … }", "What is taken where the condition is false.", snippet="else {\n\t$0\n}"),
    "group": _w(
        "group { … }",
        "Children, then transforms that apply to all of them.",
        snippet="group {\n\t$0\n}",
    ),
    "chain": _w(
        "chain { … }",
        "Objects in order; each after the first may carry `union`, `smooth`, `subtract` or `intersect`.",
        snippet="chain {\n\t$0\n}",
    ),
    "union": _w("union", "Joins: a later object is drawn over an earlier one."),
    "smooth": _w("smooth", "Joins with a blend of width 0.15, of shape and colour."),
    "subtract": _w("subtract", "Cuts the object out of what came before."),
    "intersect": _w("intersect", "Keeps of what came before only what lies in the object."),
    "material": _w(
        "material NAME { … }",
        "The material of a block, with its texture transforms; or a material as a value.",
        snippet="material ${1:flat} { color(${2:#d33}); }",
    ),
    "true": _w("true", "The boolean."),
    "false": _w("false", "The boolean."),
    "in": _w("in", "`param k = 1 in 0..2;` bounds a param; `for (i in 0..<4)` runs through a range."),
    "as": _w("as", 'Names what an import brings: `import "lib.nsg" as lib;`.'),
    "step": _w("step", "The distance of a range's values: `0..1 step 0.25`."),
}


def word_for_call(name: str, in_material: bool) -> Word | None:
    """The word of the language that is called by a name."""
    first, second = (OPERATIONS, TRANSFORMS) if in_material else (TRANSFORMS, OPERATIONS)
    return first.get(name) or second.get(name) or SETTINGS.get(name) or FUNCTION_WORDS.get(name)
