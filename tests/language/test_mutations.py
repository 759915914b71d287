"""One slip in a sound scene is one diagnostic where it is: held to the figures of the mutation study."""

from __future__ import annotations

import random

import pytest

from scenelang.language.diagnostics import SourceFile
from scenelang.language.lexer import Report, scan
from tests.language.mutations import (
    KINDS,
    PLAUSIBLE,
    Table,
    check,
    exhaust,
    is_language,
    parsed_only,
    sample,
    scenes,
    study,
    together,
)
from tests.language.reading import SCENES, read

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
    hold(table, all_=0.92, each=0.8, most=0.005)


def test_every_kind_of_slip_makes_mistakes(table: Table) -> None:
    assert {kind for (kind, _), tally in table.items() if tally.outcomes} == set(KINDS)
    assert len(together(table, "syntax").outcomes) > 4 * EACH
    assert len(together(table, "meaning").outcomes) > EACH / 2
    assert together(table).still_sound > 0  # the judge lets some pass


@pytest.mark.slow
def test_one_slip_anywhere_is_one_diagnostic() -> None:
    hold(study(exhaust(seed=3, tries=1)), all_=0.92, each=0.8, most=0.003)


def test_scenes_are_sound() -> None:
    assert len(scenes()) >= 17
    for scene in scenes():
        assert is_language(scene.text)
        diagnostics, _, meant = check(scene, scene.text)
        assert meant, diagnostics


def test_several_slips_are_as_many_diagnostics() -> None:
    """Five slips in a file of 40 lines, each of which is one diagnostic by itself, are five together."""
    text = "\n".join(path.read_text("utf-8").replace("nsg 1;", "", 1) for path in SCENES)
    source = SourceFile("sound.nsg", text)
    tokens = scan(source, Report(source))
    generator = random.Random(5)
    right = 0
    for _ in range(40):
        chosen: dict[int, tuple[int, int, str]] = {}
        while len(chosen) < 5:
            index = generator.randrange(len(tokens.kinds) - 2)
            start, end = tokens.starts[index], tokens.ends[index]
            line = source.position(start)[0]
            new = generator.choice(["", f"{generator.choice(PLAUSIBLE)} {text[start:end]}"])
            alone = read(text[:start] + new + text[end:])[1]
            if len(alone) == 1 and all(abs(line - other) > 3 for other in chosen):
                chosen[line] = start, end, new
        changed = text
        for start, end, new in sorted(chosen.values(), reverse=True):
            changed = changed[:start] + new + changed[end:]
        right += len(read(changed)[1]) == 5
    assert right >= 38
