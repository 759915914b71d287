"""Animations are checked at several frames, and what is found in a later one names it."""

from __future__ import annotations

import pytest

from scenelang.compiler import check
from scenelang.language import evaluation as evaluate
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source

SECOND = "animate(seconds = 1, fps = 40, loop = false);\n"


def look(text: str, every: bool = False) -> tuple[list[str], tuple[int, int]]:
    """The codes and frames of what is found, and how many frames were looked at."""
    found = Diagnostics()
    evaluation = Source(text=SourceFile("a.nsg", text)).evaluation(found, replays=True)
    scene, spans = evaluation.run(0)
    if scene is not None:
        check.check_compiles(scene, spans, found)
    seen = check.check_frames(evaluation, found, first=scene, every=every)
    return [f"{d.code}{d.message.partition('(frame')[2].rstrip(')')}" for d in found], seen


@pytest.mark.parametrize(
    ("statement", "some", "every"),
    [
        ("square { rotate(TAU * u); }", ["E0302 1"], ["E0302 1"]),
        ("star { translate(sin(2 * PI * t), 0); }", ["E0302 1"], ["E0302 1"]),
        ("star { rotate(45deg + 10 * t); }", ["E0302 1"], ["E0302 1"]),
        ("star { scale([1, 2, 3][floor(frame / 10)]); }", ["E0307 39"], ["E0307 30"]),
        ("if (frame == 20) { star { scale(1 / 0); } }", ["E0304 20"], ["E0304 20"]),
        ("if (frame == 33) { star { scale(1 / 0); } }", [], ["E0304 33"]),
        ("star { material flat { color([1, 1, 2 * u]); } }", ["W0301 20"], ["W0301 20"]),
        ("for (i in 0..frames - 1 - frame) { star; }", [], []),
        ("star { translate(1 / (frame - 50), sin(TAU * u * 1rad)); }", [], []),
        ("star { scale(1 / 0); } square { rotate(t); }", ["E0304", "E0302 1"], ["E0304", "E0302 1"]),
        # An angle that is 0 in the frames that were looked at.
        ("star { rotate(floor(u / 2)); }", ["W0303"], ["W0303"]),
        ("star { rotate(angle = frame == 33 ? 1 : 0); }", ["W0303"], ["E0302 33"]),
        (
            "let a = 0 * t; star { translate(cos(a), 0); material flat { hue(a); } }",
            ["W0303"] * 2,
            ["W0303"] * 2,
        ),
        ("star { rotate(0); } square { rotate(0 * 1); }", [], []),
        ("star { rotate(floor(u / 2) * 1deg); }", [], []),
        # What the compiler refuses: booleans that nest too deeply in the middle.
        (
            "module m(n) { if (n > 0) { subtract { square { scale(n / 20); } m(n - 1); } }\n"
            "else { subtract { star { scale(0.3); } square { scale(0.1); } } } }\n"
            "m(18 - floor(18 * abs(u - 0.5)));",
            ["E0409 20"],
            ["E0409 14"],
        ),
        ("star { scale(0.3); twirl(20 * u); }", ["W0502 20"], ["W0502 16"]),
    ],
)
def test_what_later_frames_have(statement: str, some: list[str], every: list[str]) -> None:
    assert look(SECOND + statement) == (some, (4, 4))
    assert look(SECOND + statement, every=True) == (every, (40, 40))


@pytest.mark.parametrize(("fps", "frames"), [(0.1, 1), (1, 1), (2, 2), (3, 3), (4, 4), (9, 4)])
def test_each_frame_is_looked_at_once(fps: float, frames: int) -> None:
    assert look(f"animate(1, {fps}); star {{ scale(0.5); rotate(1turn * u); }}") == ([], (frames, frames))


def test_scenes_without_animation_are_run_once(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []
    run = Evaluation.run
    monkeypatch.setattr(Evaluation, "run", lambda self, frame: runs.append(frame) or run(self, frame))
    assert look("star;") == ([], (1, 1))
    assert runs == [0]


def test_frames_share_the_limits_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "animate(1, 40); for (i in 0..<10) { star { scale(0.5); rotate(1turn * u * i); } }"
    monkeypatch.setattr(evaluate, "MAX_OBJECTS", 45)
    assert look(text, every=True) == ([], (5, 40))
    monkeypatch.undo()
    monkeypatch.setattr(evaluate, "MAX_STEPS", 1)
    assert look(text, every=True) == ([], (1, 40))
