"""One slip in a sound scene is one diagnostic where it is: held to the figures of the mutation study."""

from __future__ import annotations

import random

from scenelang.language.diagnostics import SourceFile
from scenelang.language.lexer import Report, scan
from tests.language.mutations import KINDS, PLAUSIBLE, check, is_language, parsed_only, scenes, share, study
from tests.language.reading import SCENES, read

EACH = 30
"""Slips of a kind."""


def test_one_slip_is_one_diagnostic() -> None:
    outcomes = study(EACH, seed=3)
    mistakes = [o for o in outcomes if o.fault != "none"]
    assert share(mistakes, "good") >= 0.92
    assert share(parsed_only(mistakes), "good") >= 0.92
    assert all(o.tree and o.count for o in mistakes)
    assert sum(o.count > 3 for o in mistakes) <= 0.005 * len(mistakes)
    assert {o.mutation.kind for o in mistakes} == set(KINDS)
    for kind in KINDS:
        assert share([o for o in mistakes if o.mutation.kind == kind], "good") >= 0.8, kind
    faults = [o.fault for o in outcomes]
    assert faults.count("syntax") > 4 * EACH
    assert faults.count("meaning") > EACH / 2
    assert faults.count("none") > 0  # the judge lets some pass


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
    for _ in range(10):
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
    assert right >= 9
