"""One slip in a sound scene is one diagnostic where it is: held to the figures of the mutation study."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest

from tests.language.mutations import (
    KINDS,
    Mutation,
    Scene,
    Table,
    check,
    exhaust,
    is_language,
    mutate,
    parsed_only,
    sample,
    scenes,
    study,
    together,
)

EACH = 90
"""Slips of a kind in the default run."""


@pytest.fixture(scope="module")
def table() -> Table:
    return study(sample(EACH, seed=1))


def hold(table: Table, all_: float, each: float, most: float) -> None:
    """The figures that the language promises."""
    everything = together(table)
    assert everything.share("good") >= all_
    assert everything.share("tree") == 1
    assert not [outcome.mutation for outcome in everything.outcomes if outcome.count == 0]
    too_many = [o for o in everything.outcomes if o.count > 3]
    assert len(too_many) <= most * len(everything.outcomes), [o.mutation.what for o in too_many]
    assert parsed_only(everything).share("good") >= all_
    for (kind, fault), tally in table.items():
        if len(tally.outcomes) >= 50:
            assert tally.share("good") >= each, (kind, fault)


def test_one_slip_is_one_diagnostic(table: Table) -> None:
    hold(table, all_=0.94, each=0.85, most=0.005)


def test_every_kind_of_slip_makes_mistakes(table: Table) -> None:
    assert {kind for (kind, _), tally in table.items() if tally.outcomes} == set(KINDS)
    assert len(together(table, "syntax").outcomes) > 4 * EACH
    assert len(together(table, "meaning").outcomes) > EACH / 2
    assert together(table).still_sound > 0  # the judge lets some pass


@pytest.mark.slow
def test_one_slip_anywhere_is_one_diagnostic() -> None:
    hold(study(exhaust(seed=3, tries=1)), all_=0.94, each=0.85, most=0.003)


def test_scenes_are_sound() -> None:
    assert len(scenes()) >= 17
    for scene in scenes():
        assert is_language(scene.text)
        diagnostics, _, meant = check(scene, scene.text)
        assert meant, diagnostics


def test_a_seed_gives_the_same_slips() -> None:
    def made(slips: Iterator[tuple[Scene, Mutation]]) -> list[str]:
        return [mutation.text for _, mutation in slips]

    assert made(sample(5, seed=4)) == made(sample(5, seed=4))
    assert made(sample(5, seed=4)) != made(sample(5, seed=5))


@pytest.mark.parametrize("kind", KINDS)
def test_slips_change_one_token(kind: str) -> None:
    """A slip changes the text on the lines that it says, and nowhere else."""
    scene = Scene("small", "let a = 1;\nlet b = a + 2;\nsquare { scale(b); }\n", scenes()[0].path)
    generator = random.Random(0)
    made = [mutate(scene, k, index, generator) for k in KINDS if k == kind for index in range(20)]
    for mutation in filter(None, made):
        old, new = scene.text.split("\n"), mutation.text.split("\n")
        assert len(old) == len(new)
        changed = [number for number, (a, b) in enumerate(zip(old, new, strict=True), 1) if a != b]
        assert changed
        assert set(changed) <= set(mutation.lines)
    assert any(made)
