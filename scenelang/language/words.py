"""The words of the language: how each is called and what it means. The one table of them.

The evaluator takes arguments from it, the language server texts and highlighters words.
``python -m lab docs words`` writes what is made from it: grammars for editors and the tables of the docs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, get_args

from scenelang.assets.records import Record

UNITS: Final = ("deg", "rad", "turn", "ms", "s")
Combine = Literal["union", "smooth", "subtract", "intersect"]
COMBINE: Final[tuple[Combine, ...]] = get_args(Combine)
TOKENS: Final[dict[str, int]] = {word: number for number, word in enumerate(COMBINE)}
"""Words that join an object to what came before, and the number that a Program stores for it."""
BLEND: Final = 0.15
"""The k of `smooth` unless said: it blends where distances differ by less, and lowers them by up to k/4."""


class Word(Record):
    name: str
    head: str  # how it is written, as in a reference
    text: str  # what it means, in Markdown
    params: tuple[str, ...] = ()  # names of its arguments, in order; of several forms those of the longest
    required: int = 0  # how many of them, from the left, have to be given
    about: tuple[str, ...] = ()  # a line for each argument
    snippet: str = ""  # what completion inserts, with placeholders; empty for the word itself
    variadic: bool = False  # whether its one argument may be repeated
    kinds: tuple[str, ...] = ()  # of each argument, as `modifiers.KINDS` reads it

    @property
    def notes(self) -> dict[str, str]:
        """A line for each argument that has one."""
        return dict(zip(self.params, self.about, strict=False))


def _table(*words: Word) -> dict[str, Word]:
    return {word.name: word for word in words}


def _word(head: str, text: str, snippet: str = "") -> Word:
    return Word(head.partition(" ")[0], head, text, snippet=snippet)


def signature(name: str, params: Sequence[str], required: int) -> str:
    """Form of a call, for help texts: ``translate(x, y[, z])``."""
    text = ", ".join(params[:required])
    for param in params[required:]:
        text += f"[, {param}]" if text else f"[{param}]"
    return f"{name}({text})"


def _call(
    name: str, params: str, text: str, about: tuple[str, ...] = (), snippet: str = "", head: str = ""
) -> Word:
    """A word with arguments: ``x?`` may be left out, ``x…`` may be repeated, ``x:KIND`` is not a number."""
    given = [param.partition(":")[0] for param in params.split()]
    kinds = tuple([param.partition(":")[2] or "number" for param in params.split()])
    names = [param.rstrip("?…") for param in given]
    required = sum(not param.endswith("?") for param in given)
    variadic = params.endswith("…")
    if not snippet:
        holes = ", ".join(f"${{{at}:{param}}}" for at, param in enumerate(names, 1))
        snippet = f"{name}({holes})"
    shown = signature("", names, required)[1:-1] if required else f"[{', '.join(names)}]" * bool(names)
    head = head or f"{name}({shown}{', …' * variadic})"
    return Word(name, head, text, tuple(names), required, about, snippet, variadic, kinds)


_ANGLE = "an angle, such as `30deg`, `0.5rad` or `0.25turn`"
_TURN = "R(a) turns a point clockwise by a, so what it draws turns counter-clockwise."
_ROUNDS = ("rounds the edge that is cut over this width; sharp without it",)
_RATE = ("radians per unit length, a bare number",)

DECLARING: Final = _table(
    _word("nsg 1;", "The language version; the first statement.", "nsg 1;"),
    _word(
        'model "name";',
        "Render with this model; without it the usual one of the scene's dimension.",
        'model "$1";',
    ),
    _word(
        "param NAME = expr [in range];",
        "An input with a default and perhaps a range, at top level; `-D NAME=value` sets it.",
        "param ${1:name} = ${2:0.5} in ${3:0..1};",
    ),
    _word("let NAME = expr;", "A name for a value, bound once, from its line on.", "let ${1:name} = $2;"),
    _word("fn NAME(a, b = 1) = expr;", "A pure function.", "fn ${1:name}(${2:x}) = $3;"),
    _word(
        "module NAME(a, b = 1) { … }",
        "A piece of scene that is called like an object.",
        "module ${1:name}(${2:at}) {\n\t$0\n}",
    ),
    _word(
        'import "path.nsg" as NAME;',
        "Brings what another file defines, as `NAME.name`; at top level.",
        'import "$1" as ${2:lib};',
    ),
    _word("as", 'Names what an import brings: `import "lib.nsg" as lib;`.'),
)
CONTROL: Final = _table(
    _word(
        "for (i in range) { … }",
        "Repeats a block for each value of a range or a vector.",
        "for (${1:i} in ${2:0..<4}) {\n\t$0\n}",
    ),
    _word("in", "`param k = 1 in 0..2;` bounds a param; `for (i in 0..<4)` runs through a range."),
    _word("step", "The distance of a range's values: `0..1 step 0.25`."),
    _word("if (condition) { … } else { … }", "Takes one of two blocks.", "if (${1:condition}) {\n\t$0\n}"),
    _word("else { … }", "What is taken where the condition is false.", "else {\n\t$0\n}"),
)
NODES: Final = _table(
    _word("group { … }", "Children, then transforms that apply to all of them.", "group {\n\t$0\n}"),
    _word(
        "chain { … }",
        "Objects in order; each after the first may carry `union`, `smooth`, `subtract` or `intersect`.",
        "chain {\n\t$0\n}",
    ),
    _word("union", "Joins: a later object is drawn over an earlier one."),
    _call(
        "smooth", "k?", "Joins with a blend, of shape and colour.", ("its width, 0.15 by default",), "smooth"
    ),
    _call("subtract", "k?", "Cuts the object out of what came before.", _ROUNDS, "subtract"),
    _call("intersect", "k?", "Keeps of what came before only what lies in the object.", _ROUNDS, "intersect"),
)
MATERIAL: Final = _table(
    _word(
        "material NAME { … }",
        "The material of a block, with its texture transforms; or a material as a value.",
        "material ${1:flat} { color(${2:#d33}); }",
    )
)
TRUTH: Final = _table(_word("true", "The boolean."), _word("false", "The boolean."))
KEYWORDS: Final = DECLARING | CONTROL | NODES | MATERIAL | TRUTH
RESERVED: Final = tuple(word for word in KEYWORDS if word not in ("step", "as"))
"""The keywords that name nothing else; `step` and `as` are keywords only where they can follow something."""

PLAIN_SETTINGS: Final = _table(
    _call(
        "canvas",
        "w:side h:side",
        "The output size in pixels, 256 × 256 without it, at most 8192 a side. `--size` overrides it.",
        ("width in pixels", "height in pixels"),
        "canvas(${1:256}, ${2:256});",
    ),
    _call(
        "background",
        "c:backdrop",
        "The colour where nothing is drawn, without it white in 2D and the sky in 3D; `none` leaves it "
        "transparent.",
        ("a colour, or `none`",),
        "background(${1:#fff});",
    ),
    _call(
        "animate",
        "seconds:seconds fps:fps loop?:boolean",
        "Makes `t`, `u`, `frame` and `frames` run.",
        ("how long, such as `2s`", "frames a second", "whether the end joins the start"),
        "animate(seconds = ${1:2}, fps = ${2:24}, loop = ${3|true,false|});",
        head="animate(seconds, fps, loop = true)",
    ),
    _call(
        "samples",
        "n:samples",
        "How many samples a pixel is the mean of, 4 or 16, 4 without it. `--samples` overrides it.",
        ("4 or 16, on a regular grid",),
        "samples(${1|16,4|});",
    ),
)
STAGE: Final = _table(
    _call(
        "camera",
        "eye?:point target?:point fov?:angle",
        "3D: where the picture is taken from, without it from [0, 1.2, 6] to the origin.",
        ("a point", "the point it looks at", "angle of view across the shorter side, 36.87° by default"),
        "camera(eye = [${1:0}, ${2:1.2}, ${3:6}]);",
    ),
    _call(
        "light",
        "position?:point power? color?:opaque",
        "3D: the point light, without it a white one of power 28 at [2.5, 4, 3].",
        ("a point", "what a white surface at distance 1 receives, from 0", "its colour"),
        "light(position = [${1:2.5}, ${2:4}, ${3:3}]);",
    ),
    _call(
        "ground",
        "y? color?:opaque",
        "3D: the plane below, without it at y = −1; `ground(none)` leaves it out.",
        ("its height, or `none`", "its colour"),
        "ground(${1:-1});",
    ),
)
"""Settings of 3D scenes; a scene's own module of such a name hides them."""
SETTINGS: Final = PLAIN_SETTINGS | STAGE
_BOTH: Final = _table(
    _call(
        "translate",
        "x y z?",
        "Moves by a vector. A vector may stand for the components: `translate(at)`.",
        ("along x", "along y", "along z, 0 by default"),
        "translate(${1:0}, ${2:0});",
    ),
    _call(
        "rotate",
        "angle:angle axis?:axis",
        "Turns counter-clockwise about an axis through the origin, by the right hand in 3D.",
        (_ANGLE, "`X`, `Y`, `Z` or a vector; `Z` by default, the only one in 2D"),
        "rotate(${1:30}deg);",
        head="rotate(angle[, axis = Z])",
    ),
    _call(
        "scale",
        "sx:factor sy:factor sz?:factor",
        "Scales about the origin, evenly or along each axis; not by 0. `sz` does nothing in 2D (W0508).",
        ("along x, or evenly where it is alone", "along y", "along z, 1 by default"),
        "scale(${1:0.5});",
        head="scale(s) or scale(sx, sy[, sz])",
    ),
    _call(
        "shear",
        "xy? xz? yx? yz? zx? zy?",
        "x grows by k·y; likewise `xz`, `yx`, `yz`, `zx`, `zy`. One term a call.",
        ("x += k·y", "x += k·z", "y += k·x", "y += k·z", "z += k·x", "z += k·y"),
        "shear(${1|xy,yx|} = ${2:0.5});",
        head="shear(xy = k)",
    ),
)
TRANSFORMS: Final = _BOTH | _table(
    _call(
        "matrix",
        "rows:rows",
        "An affine map, not singular, by its rows, for column vectors; the last one is 0, 0, 0, 1.",
        ("four rows of four numbers",),
        "matrix([[${1:1}, 0, 0, ${2:0}], [0, ${3:1}, 0, ${4:0}], [0, 0, 1, 0], [0, 0, 0, 1]]);",
        head="matrix([[…4], […4], […4], […4]])",
    ),
    _call(
        "twirl",
        "k:rate",
        "Turns each point by k times its distance from the origin: p → R(k·|p|) p on the way back. " + _TURN,
        _RATE,
        "twirl(${1:1});",
    ),
    _call(
        "bend",
        "k:rate",
        "Turns each point by k times its x: p → R(k·p.x) p on the way back. " + _TURN,
        _RATE,
        "bend(${1:0.5});",
    ),
    _call("twist", "k:rate", "3D: turns (x, z) by k·y, on the way back.", _RATE, "twist(${1:1});"),
    _call(
        "displace",
        "amount frequency",
        "3D: adds amount · sin(f x) sin(f y) sin(f z) to the leaf's distance; first in its block, and once.",
        ("how far", "f, radians per unit length"),
        "displace(${1:0.1}, ${2:8});",
    ),
    _call(
        "grow",
        "r:growth",
        "Takes r off the leaf's distance: its edge moves out, round about corners, or in; first in its "
        "block, once.",
        ("leaf units, −0.5 to 1",),
        "grow(${1:0.1});",
    ),
    _call(
        "shell",
        "w:wall",
        "Keeps a wall about the leaf's edge, half on either side: a 2D outline, a hollow body; first in its "
        "block, once.",
        ("how thick the wall is, leaf units, above 0, at most 1",),
        "shell(${1:0.1});",
    ),
)
OPERATIONS: Final = _BOTH | _table(
    _call("flip", "", "Mirrors the texture: x → −x.", snippet="flip();"),
    _call(
        "color",
        "c:colour",
        "Multiplies the material's colour.",
        ("`#d33`, `[r, g, b]`, `rgb(r, g, b)` or `hsv(h, s, v)`",),
        "color(${1:#d33});",
    ),
    _call(
        "grayscale",
        "a",
        "Mixes with the luma 0.2126 R + 0.7152 G + 0.0722 B: 0 keeps the colour, 1 makes it grey.",
        ("0 keeps the colour, 1 is grey",),
        "grayscale(${1:1});",
    ),
    _call("hue", "angle:hue", "Shifts the hue, keeping S and V of HSV.", (_ANGLE,), "hue(${1:0.1}turn);"),
    _call(
        "opacity",
        "a:share",
        "2D: how much of what lies behind an object it hides; anywhere in the block, and once.",
        ("0 shows all of it, 1 none",),
        "opacity(${1:0.5});",
    ),
    _call(
        "stop",
        "offset c:colour",
        "A stop of a gradient, which has 2 to 8 in order; of equal offsets the edge is hard.",
        ("where it lies, 0 to 1", "`#d33`, `[r, g, b]`, `rgb(r, g, b)` or `hsv(h, s, v)`"),
        "stop(${1:0}, ${2:#d33});",
    ),
)
"""Operations in a material's block."""
PROPERTIES: Final = ("opacity",)
"""Those that stand in no order with the others, each at most once."""

FUNCTIONS: Final = _table(
    _call("sin", "x:angle", "The sine of an angle."),
    _call("cos", "x:angle", "The cosine of an angle."),
    _call("tan", "x:angle", "The tangent of an angle."),
    _call("asin", "x", "The angle whose sine is x."),
    _call("acos", "x", "The angle whose cosine is x."),
    _call("atan2", "y x", "The angle of the point (x, y), from the x axis."),
    _call("abs", "x", "The absolute value of a number, an angle or a time."),
    _call("min", "x…", "The least of its arguments; of one vector the least item, of several componentwise."),
    _call(
        "max",
        "x…",
        "The greatest of its arguments; of one vector the greatest item, of several componentwise.",
    ),
    _call("clamp", "x low high", "x kept between low and high."),
    _call("floor", "x", "The greatest whole number not above x."),
    _call("ceil", "x", "The least whole number not below x."),
    _call("round", "x", "The nearest whole number; halves away from zero."),
    _call("sqrt", "x", "The square root."),
    _call("exp", "x", "e to the x."),
    _call("log", "x", "The natural logarithm."),
    _call("mix", "a b t", "a (1 − t) + b t: numbers, angles, vectors, colours."),
    _call("smoothstep", "low high x", "0 below low, 1 above high, 3t² − 2t³ between."),
    _call("len", "v", "How many items a vector or range has, or characters a string."),
    _call(
        "rand",
        "seed",
        "A number in [0, 1), the same everywhere: the top 53 bits of SplitMix64 over the bits of the seed; "
        "of a vector, folded over its items.",
    ),
    _call("rgb", "r g b", "A colour; components in 0..1."),
    _call("hsv", "h s v", "A colour by hue (turns or an angle), saturation and value."),
)
LETTERS: Final = _table(
    _call(
        "text",
        "text:string size? align?:string",
        "A line of letters of an imported font, a union, with its baseline on y = 0.",
        ("a string", "the em in world units, 1 by default", '`"left"`, `"center"` or `"right"` of x = 0'),
        'text("$1", size = ${2:0.5});',
        head='text("Ag", size = 1, align = "left")',
    ),
    _call(
        "width",
        "text:string size?",
        "The width of a line of letters of an imported font, in world units.",
        ("a string", "the em in world units, 1 by default"),
        head='width("Ag", size = 1)',
    ),
)
"""What a font brings, behind the name of its import."""
CONSTANTS: Final = _table(
    _word("PI", "3.14159…, a number; half a turn is `0.5turn`."),
    _word("TAU", "2π, a number."),
    _word("X", "The x axis, `[1, 0, 0]`."),
    _word("Y", "The y axis, `[0, 1, 0]`."),
    _word("Z", "The z axis, `[0, 0, 1]`."),
    _word("none", "No background: `background(none)`."),
)
ANIMATED: Final = _table(
    _word("t", "The time of the frame in seconds; 0 without `animate`."),
    _word("u", "How far the animation is, in [0, 1) for a loop; 0 without `animate`."),
    _word("frame", "The number of the frame, from 0."),
    _word("frames", "How many frames there are; 1 without `animate`."),
)

LEAVES: Final[dict[int, dict[str, str]]] = {
    2: {
        "square": "Corners on the unit circle: sides of √2, half a side is 0.707. "
        'For sides of your own, `import "std/shapes" as s;` and `s.rect(w, h)`.',
        "triangle": "Regular, circumradius 1, a vertex at +y.",
        "pentagon": "Regular, circumradius 1, a vertex at +y.",
        "star": "Five points, outer radius 1, inner radius 0.381966, a point at +y.",
        "disc": "Radius 1.",
        "hexagon": "Regular, circumradius 1, a vertex at +y.",
    },
    3: {
        "sphere": "Radius 1.",
        "torus": "Radii 0.7 and 0.3, axis y.",
        "box": "A cube with corners on the unit sphere: half a side is 1/√3, 0.577.",
        "cylinder": "Axis y, radius and half-height 1/√2, 0.707.",
        "cone": "Axis y, apex (0, 1, 0), base at y = -0.5 of radius √3/2, 0.866.",
        "capsule": "All within 0.5 of the segment from (0, -0.5, 0) to (0, 0.5, 0).",
        "octahedron": "Corners on the axes at 1: |x| + |y| + |z| ≤ 1.",
    },
}
"""The geometries of the plane and of space."""
SHADINGS: Final[dict[int, dict[str, str]]] = {
    2: {"flat": "A constant colour, white without `color`."},
    3: {
        "diffuse": "Lambertian, lit by the model's point light.",
        "volumetric": "A medium that absorbs and scatters.",
    },
}
"""Shadings of a material, in the plane and in space; the first of each is an object's without a material."""
TEXTURES: Final = (
    *("arrows", "bricks", "checker", "cobbles", "dots", "hexagons", "leaves", "letters"),
    *("noise", "plaid", "stripes", "terrazzo", "tiles", "waves", "wood", "zigzag"),
)
"""Materials that are pictures, in the plane and in space."""
GRADIENTS: Final = {
    "linear": "A gradient between `stop`s, over x from −1 to 1.",
    "radial": "A gradient between `stop`s, over the distance from the origin, 0 to 1.",
}
PAINTS: Final = dict.fromkeys(TEXTURES, "A texture, in flat and in solid scenes.") | GRADIENTS
"""Materials whose colour differs from place to place, in the plane and in space."""
GEOMETRIES: Final = LEAVES[2] | LEAVES[3]
MATERIALS: Final = SHADINGS[2] | SHADINGS[3]
SOLID_TRANSFORMS: Final = "twist", "displace"
"""Transforms that leave the plane."""
OWN_TRANSFORMS: Final = "grow", "shell", "displace"
"""Transforms of a leaf's own distance, which stand first in its block, each at most once."""
NEWER: Final = frozenset(("grow", "shell", "stop", "samples", "opacity", *STAGE))
"""Words that head a statement unless a scene's own module has their name."""
SCENES: Final = {2: "flat", 3: "solid"}
"""Names for scenes of a dimension."""


def dimension_of(name: str) -> int | None:
    """The dimension of scenes that have a geometry or a shading; None for a name that either may have."""
    return next((d for d in LEAVES if name in LEAVES[d] or name in SHADINGS[d]), None)


LANGUAGE: Final = frozenset((*TRANSFORMS, *OPERATIONS, *PLAIN_SETTINGS)) - NEWER
"""Words that head a statement; no module, material or geometry can have such a name."""


def word_for_call(name: str, in_material: bool) -> Word | None:
    """The word of the language that is called by a name."""
    tables = (OPERATIONS, TRANSFORMS) if in_material else (TRANSFORMS, OPERATIONS)
    return next((table[name] for table in (*tables, SETTINGS, FUNCTIONS, NODES) if name in table), None)
