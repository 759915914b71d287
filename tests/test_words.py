"""The words are those of grammar, evaluator and models, and what is made of them is current."""

from __future__ import annotations

import re
from pathlib import Path

from lab.docs.make_words import made
from scenelang.assets.element_file import load_textures
from scenelang.compiler.manifest import available, load_manifest
from scenelang.editors.highlighting import OPERATORS
from scenelang.language import modifiers, values, words
from scenelang.language.tables import tables

ROOT = Path(__file__).parents[1]


def test_keywords_and_units_are_those_of_the_grammar() -> None:
    assert sorted(words.KEYWORDS) == sorted(text for text in tables().literals if text[0].isalpha())
    assert f"(?:{'|'.join(words.UNITS)})" in tables().patterns["NUMBER"]
    assert words.TOKENS == {"union": 0, "smooth": 1, "subtract": 2, "intersect": 3}
    assert [*"()[]{},;"] == [
        sign for sign in "()[]{},;" if sign in tables().literals and sign not in OPERATORS
    ]


def test_everything_called_has_a_meaning() -> None:
    assert values.FUNCTIONS.keys() == words.FUNCTIONS.keys()
    assert values.CONSTANTS.keys() == words.CONSTANTS.keys()
    assert {
        kind
        for table in (words.SETTINGS, words.TRANSFORMS, words.OPERATIONS)
        for word in table.values()
        for kind in word.kinds
    } <= modifiers.KINDS.keys()
    for model in map(load_manifest, available()):
        assert words.LEAVES[model.dimension].keys() >= {*model.geometries}
        assert [*words.SHADINGS[model.dimension]] == [*model.shadings]
    assert {*words.SOLID_TRANSFORMS} <= words.TRANSFORMS.keys()
    assert (*load_textures(),) == words.TEXTURES


def test_heads_show_the_parameters() -> None:
    """In their order, the optional ones in brackets or with a default, unless the head is an example."""
    for word in (words.FUNCTIONS | words.TRANSFORMS | words.OPERATIONS | words.SETTINGS).values():
        assert len(word.about) in (0, len(word.params)), word.name
        assert 0 <= word.required <= len(word.params), word.name
        if word.name not in ("shear", "matrix"):
            head = word.head[word.head.rindex("(") :]
            assert tuple(re.findall(r"\w+", re.sub(r" = \w+", "", head))) == word.params
            needed = re.split(r"\[|, \w+ = ", head)[0]
            assert tuple(re.findall(r"\w+", needed)) == word.params[: word.required]
            assert word.variadic == word.head.endswith("…)"), word.name


def test_what_is_made_of_them_is_current() -> None:
    """`python -m lab docs words` would change nothing."""
    for path, text in made().items():
        assert path.read_text("utf-8") == text, f"{path.name}: run python -m lab docs words"
