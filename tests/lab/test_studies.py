"""Trainings of stated budgets: schedules, resuming, and that each renderer learns."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest
import torch

from lab.designs.encoders import LiftingConfig
from lab.designs.students import StudentConfig
from lab.designs.studies import SIGMA, Study, StudyConfig, level_at, rate_at
from scenelang.renderers.reading import ReadingConfig
from scenelang.renderers.streaming import StreamingConfig


def config(renderer: str = "streaming", lifting: str = "learned", **changes: object) -> StudyConfig:
    student = StudentConfig(
        renderer,  # type: ignore[arg-type]
        lifting,  # type: ignore[arg-type]
        learned=LiftingConfig(32, 32, 16),
        streaming=StreamingConfig(resolution=8, width=1 / 32),
        reading=ReadingConfig(hidden=16, reads=2),
    )
    return StudyConfig(student, **{"seconds": 1e6, "scenes": 4, "points": 32, **changes})  # type: ignore[arg-type]


def test_growing_ends_at_the_last_level_and_blends_each_in() -> None:
    shares = [i / 1000 for i in range(1001)]
    levels = [level_at(share, 32, True) for share in shares]
    assert levels[0] == (4, 1.0)
    assert levels[-1] == (32, 1.0)
    for (r0, b0), (r1, b1) in itertools.pairwise(levels):
        assert (r1 == r0 and b1 >= b0) or (r1 == 2 * r0 and b1 < 0.1)
    assert level_at(0.0, 32, False) == (32, 1.0)


def test_the_rate_falls_as_in_the_paper() -> None:
    c = config(rate=1e-3)
    assert rate_at(0.3, c) == pytest.approx(1e-3)
    assert rate_at(0.6, c) == pytest.approx(math.sqrt(10) * 1e-4)
    assert rate_at(0.0, c) < 1e-4
    assert rate_at(1.0, c) == pytest.approx(math.sqrt(10) * 1e-5)


@pytest.mark.parametrize(
    ("renderer", "lifting"),
    [("streaming", "learned"), ("reading", "learned"), ("framed", "exact"), ("framed", "learned")],
)
def test_a_few_scenes_are_learned(renderer: str, lifting: str) -> None:
    torch.manual_seed(0)
    study = Study(config(renderer, lifting, fixed=2, scenes=2, rate=5e-3, grow=False))
    # by steps, not by time; framed learns its leaves first only at shares of the budget that are not reached
    losses = [p.loss for p in itertools.islice(study.run(), 200 if renderer == "streaming" else 60)]
    assert all(map(math.isfinite, losses))
    # a likelihood of the first deviation is no lower than its logarithm
    least = math.log(SIGMA[0]) if renderer == "streaming" else 0.0
    first, last = sum(losses[:10]) / 10 - least, sum(losses[-10:]) / 10 - least
    assert last < 0.9 * first


def test_it_resumes_where_it_was(tmp_path: Path) -> None:
    straight = Study(config(rate=1e-3))
    whole = [p.loss for p in itertools.islice(straight.run(), 8)]
    first = Study(config(rate=1e-3), tmp_path)
    for _ in itertools.islice(first.run(), 5):
        pass
    first.progress = first.progress._replace(seconds=straight.progress.seconds)  # the schedule looks at time
    first.save()
    second = Study(config(rate=1e-3), tmp_path)
    assert second.progress.step == 5
    rest = [p.loss for p in itertools.islice(second.run(), 3)]
    assert rest == pytest.approx(whole[5:], rel=1e-3)


def test_a_killed_study_leaves_a_checkpoint(tmp_path: Path) -> None:
    """Long before the interval ends."""
    list(itertools.islice(Study(config(), tmp_path).run(), 4))
    assert 0 < Study(config(), tmp_path).progress.step <= 4


def test_another_configuration_is_refused(tmp_path: Path) -> None:
    study = Study(config(), tmp_path)
    next(study.run())
    study.save()
    with pytest.raises(ValueError, match="another configuration"):
        Study(config(rate=0.5), tmp_path)


def test_a_budget_is_kept() -> None:
    study = Study(config(seconds=0.2))
    steps = list(study.run())
    assert steps[-1].seconds >= 0.2
    assert steps[-2].seconds < 0.2 if len(steps) > 1 else True
