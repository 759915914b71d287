"""Drafts of solids that take long: what is shown first, what follows, and what calls it off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.drawing.how import How
from scenelang.language.evaluation import Source
from scenelang.output import watch
from scenelang.output.frames import FrameRange
from scenelang.output.watch import Easel, Outcome, Outdated, stamps

SOLIDS = "canvas(90, 70); sphere { scale(0.8); }\n"


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(watch, "CHECK_S", 0.0)
    monkeypatch.setattr(watch, "DRAFT_S", 0.0)
    return tmp_path / "a.nsg"


def easel(file: Path, text: str, drafts: list[Outcome]) -> Easel:
    file.write_text(text)
    made = Easel(Source(file), Path("a.png"), None, FrameRange(), 0, How())
    made.drafted = drafts.append
    return made


def test_a_draft_comes_first_and_the_picture_follows(file: Path) -> None:
    drafts: list[Outcome] = []
    here = easel(file, SOLIDS, drafts)
    done = here.draw(stamps(here.paths))
    exact = nsg.render(nsg.loads(SOLIDS))
    assert (len(drafts), drafts[0].draft, done.draft) == (1, True, False)
    assert np.array_equal(done.image, exact)
    error = np.square(np.asarray(drafts[0].image) - exact).mean()
    assert 0 < error < 0.01  # all of the picture, but coarse
    assert here.draw(stamps(here.paths)).same
    assert len(drafts) == 1


def test_flat_and_tiny_pictures_have_none(file: Path) -> None:
    drafts: list[Outcome] = []
    for text in ("canvas(90, 70); square { }", SOLIDS.replace("90, 70", "90, 15")):
        here = easel(file, text, drafts)
        assert here.draw(stamps(here.paths)).good
    assert not drafts


def test_a_save_calls_the_picture_off_and_the_draft_is_not_taken_for_it(file: Path) -> None:
    drafts: list[Outcome] = []
    here = easel(file, SOLIDS, drafts)
    done = here.draw(stamps(here.paths)).image
    whole = Path("a.png").read_bytes()
    file.write_text(SOLIDS.replace("0.8", "0.7"))
    here.drafted = lambda _: file.write_text(SOLIDS)
    with pytest.raises(Outdated):
        here.draw(stamps(here.paths))
    assert Path("a.png").read_bytes() != whole
    here.drafted = drafts.append
    again = here.draw(stamps(here.paths))  # the text that was drawn before: OUT holds the draft of another
    assert not again.same
    assert np.array_equal(again.image, done)
    assert Path("a.png").read_bytes() == whole
