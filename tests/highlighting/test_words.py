"""The words that highlighters know are those of the grammar and of the evaluator."""

from __future__ import annotations

from scenelang.evaluate import vocabulary
from scenelang.evaluate.values import functions
from scenelang.highlighting import words
from scenelang.syntax.tables import tables


def test_keywords_are_those_of_the_grammar() -> None:
    groups = (words.DECLARING, words.CONTROL, words.NODES, words.MATERIAL, words.TRUTH)
    known = [word for group in groups for word in group]
    assert sorted(known) == sorted(text for text in tables().literals if text[0].isalpha())


def test_signs_are_those_of_the_grammar() -> None:
    signs = {text for text in tables().literals if not text[0].isalpha()}
    assert sorted((*words.OPERATORS, *words.PUNCTUATION)) == sorted(signs)
    for index, sign in enumerate(words.OPERATORS):
        assert not any(sign.startswith(earlier) for earlier in words.OPERATORS[:index]), sign


def test_terminals_are_those_of_the_grammar() -> None:
    own = {"NAME": words.NAME, "NUMBER": words.NUMBER, "STRING": words.STRING, "COLOR": words.COLOR}
    assert own == tables().patterns


def test_names_are_those_of_the_evaluator() -> None:
    assert sorted(words.FUNCTIONS) == sorted(functions.FUNCTIONS)
    assert sorted(words.CONSTANTS) == sorted(functions.CONSTANTS)
    assert words.ANIMATED == functions.ANIMATED
    assert words.TRANSFORMS == vocabulary.TRANSFORMS
    assert words.SETTINGS == vocabulary.SETTINGS
    assert {*words.TEXTURE} == {*vocabulary.MATERIAL_OPS} - {*vocabulary.TRANSFORMS}
    offered = {name for m in vocabulary.shipped() for name in (*m.transforms, *m.material_ops)}
    assert offered <= {*words.TRANSFORMS, *words.TEXTURE}
