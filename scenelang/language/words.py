"""The words of the language: how each is called and what it means. The one table of them, from `words.txt`.

The evaluator takes arguments from it, the language server texts and highlighters words.
``python -m lab docs words`` writes what is made from it: grammars for editors and the tables of the docs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, Literal, get_args

from scenelang.assets.records import Record
from scenelang.language.tables import sections

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


def signature(name: str, params: Sequence[str], required: int) -> str:
    """Form of a call, for help texts: ``translate(x, y[, z])``."""
    text = ", ".join(params[:required])
    for param in params[required:]:
        text += f"[, {param}]" if text else f"[{param}]"
    return f"{name}({text})"


_CALL: Final = re.compile(r"(\w+)\((.*)\)")


def _word(written: str, text: str, *more: str) -> Word:
    """The word of an entry, whose further lines begin with what they are of."""
    about, snippets, heads = ([line[2:] for line in more if line[0] == sign] for sign in "->=")
    snippet = "".join(snippets).replace("\\n", "\n").replace("\\t", "\t")
    if (call := _CALL.fullmatch(written)) is None:
        return Word(written.partition(" ")[0], written, text, snippet=snippet)
    name, params = call[1], [param.partition(":") for param in call[2].split()]
    names = tuple([param.rstrip("?…") for param, _, _ in params])
    kinds = tuple([kind or "number" for _, _, kind in params])
    required = sum(not param.endswith("?") for param, _, _ in params)
    holes = ", ".join(f"${{{at}:{param}}}" for at, param in enumerate(names, 1))
    shown = signature("", names, required)[1:-1] if required else f"[{', '.join(names)}]" * bool(names)
    head, variadic = f"{name}({shown}{', …' * ('…' in call[2])})", "…" in call[2]
    snippet = snippet or f"{name}({holes})"
    return Word(name, "".join(heads) or head, text, names, required, tuple(about), snippet, variadic, kinds)


def _table(body: str) -> dict[str, Word]:
    """The words of a section, whose entries are apart by empty lines."""
    entries = [entry for entry in body.strip("\n").split("\n\n") if not entry.startswith("# ")]
    return {word.name: word for word in (_word(*entry.splitlines()) for entry in entries)}


_TABLES: Final = {title: _table(body) for title, body in sections("words").items()}
DECLARING: Final = _TABLES["declaring"]
CONTROL: Final = _TABLES["control"]
NODES: Final = _TABLES["nodes"]
MATERIAL: Final = _TABLES["material"]
TRUTH: Final = _TABLES["truth"]
KEYWORDS: Final = DECLARING | CONTROL | NODES | MATERIAL | TRUTH
RESERVED: Final = tuple(word for word in KEYWORDS if word not in ("step", "as"))
"""The keywords that name nothing else; `step` and `as` are keywords only where they can follow something."""

PLAIN_SETTINGS: Final = _TABLES["plain settings"]
STAGE: Final = _TABLES["stage"]
"""Settings of 3D scenes; a scene's own module of such a name hides them."""
SETTINGS: Final = PLAIN_SETTINGS | STAGE
TRANSFORMS: Final = _TABLES["moves"] | _TABLES["transforms"]
OPERATIONS: Final = _TABLES["moves"] | _TABLES["operations"]
"""Operations in a material's block."""
PROPERTIES: Final = ("opacity", "glow", "density", "roughness")
"""Those that stand in no order with the others, each at most once."""
REFLECTING: Final = ("glossy", "metal")
"""Shadings of space that need a sky; of a network they are `diffuse`."""
KINDS_WITH: Final = {"density": ("volumetric",), "roughness": REFLECTING}
"""Shadings that have a property, where not all have it."""

OUTLINES: Final = _TABLES["leaves by points"]
"""Leaves of the plane that are called with their points; a definition of such a name hides them."""
FUNCTIONS: Final = _TABLES["functions"]
LETTERS: Final = _TABLES["letters"]
"""What a font brings, behind the name of its import."""
CONSTANTS: Final = _TABLES["constants"]
ANIMATED: Final = _TABLES["animated"]


def _texts(table: str) -> dict[str, str]:
    return {name: word.text for name, word in _TABLES[table].items()}


LEAVES: Final = {2: _texts("leaves of the plane"), 3: _texts("leaves of space")}
"""The geometries of the plane and of space."""
SHADINGS: Final = {2: _texts("shadings of the plane"), 3: _texts("shadings of space")}
"""Shadings of a material, in the plane and in space; the first of each is an object's without a material."""
TEXTURES: Final = (
    *("arrows", "bricks", "checker", "cobbles", "dots", "hexagons", "leaves", "letters"),
    *("noise", "plaid", "stripes", "terrazzo", "tiles", "waves", "wood", "zigzag"),
)
"""Materials that are pictures, in the plane and in space."""
GRADIENTS: Final = _texts("gradients")
PAINTS: Final = dict.fromkeys(TEXTURES, "A texture, in flat and in solid scenes.") | GRADIENTS
"""Materials whose colour differs from place to place, in the plane and in space."""
GEOMETRIES: Final = LEAVES[2] | LEAVES[3]
MATERIALS: Final = SHADINGS[2] | SHADINGS[3]
SOLID_TRANSFORMS: Final = "twist", "displace"
"""Transforms that leave the plane."""
OWN_TRANSFORMS: Final = "grow", "shell", "displace"
"""Transforms of a leaf's own distance, which stand first in its block, each at most once."""
NEWER: Final = frozenset(("grow", "shell", "stop", "samples", *PROPERTIES, *STAGE))
"""Words that head a statement unless a scene's own module has their name."""
SCENES: Final = {2: "flat", 3: "solid"}
"""Names for scenes of a dimension."""


def dimension_of(name: str) -> int | None:
    """The dimension of scenes that have a geometry or a shading; None for a name that either may have."""
    if name in OUTLINES:
        return 2
    return next((d for d in LEAVES if name in LEAVES[d] or name in SHADINGS[d]), None)


LANGUAGE: Final = frozenset((*TRANSFORMS, *OPERATIONS, *PLAIN_SETTINGS)) - NEWER
"""Words that head a statement; no module, material or geometry can have such a name."""


def word_for_call(name: str, in_material: bool) -> Word | None:
    """The word of the language that is called by a name."""
    tables = (OPERATIONS, TRANSFORMS) if in_material else (TRANSFORMS, OPERATIONS)
    return next(
        (table[name] for table in (*tables, SETTINGS, FUNCTIONS, NODES, OUTLINES) if name in table), None
    )
