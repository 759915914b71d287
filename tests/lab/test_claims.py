"""No figure stands in the prose of the pages that no record backs."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from lab.docs.claims.common import GIVEN
from lab.docs.figures import Figure, Phrase, filled, uncovered
from lab.docs.make_claims import claimed

PAGES = {"architecture", "drawing", "elements", "index", "measurements", "README", "viewer"}


@pytest.fixture(scope="module")
def pages() -> dict[Path, ModuleType]:
    return dict(claimed())


def test_figures_are_those_of_the_records(pages: dict[Path, ModuleType]) -> None:
    assert {page.stem for page in pages} == PAGES
    for page, module in pages.items():
        text = page.read_text("utf-8")
        assert filled(text, module.CLAIMS) == text, f"{page.name}: run python -m lab docs claims"


def test_no_figure_is_without_a_record(pages: dict[Path, ModuleType]) -> None:
    """Claim it in lab/docs/claims/, say there why it needs no record, or leave it out."""
    bare, common = [], set[str]()
    for page, module in pages.items():
        text = page.read_text("utf-8")
        given = {piece: why for piece, why in GIVEN.items() if piece in " ".join(text.split())}
        common |= given.keys()
        found = uncovered(text, module.CLAIMS, {**given, **module.GIVEN})
        bare += [f"{page.name}:{line}: … {words} …" for line, words in found]
    assert not bare, "\n".join(bare)
    assert common == GIVEN.keys()


def test_a_figure_without_a_record_is_found() -> None:
    for text in (
        "It is off by 3 dB.",
        "A frame takes 12.5 of them.",
        "It takes 0.8 to 2\nms.",
        "Drawn **sixty times** as often.",
        "It is twice as fast.",
        "The mean of 20 scenes.",
        "That was 17 % more.",
        "It has 6,051 of them.",
        "| shapes | 12 |\n",
        "| shapes | **3.1** ± 0.2 |\n",
    ):
        assert [line for line, _ in uncovered(f"Words.\n\n{text}", [], {})][:1] == [3]
        assert not list(uncovered(f"```text\n{text}\n```", [], {}))
        assert not list(uncovered(f"<!-- begin all -->\n{text}\n<!-- end all -->", [], {}))
    for text in ("In 1980 it was 256² and `3 ms`.", "See [one](a-3.1.md), Figure 5, W0501."):
        assert not list(uncovered(text, [], {}))


def test_claims_and_what_is_given_cover_their_figures_alone() -> None:
    text = "It takes 12 ms of\n20 ms, capped at 50 dB, in 7 s."
    claims, given = [f"takes {Figure(12)} ms of 20 ms"], {"capped at 50 dB": "a definition"}
    found = list(uncovered(text, claims, given))
    assert [(line, words[words.index("[") :][:5]) for line, words in found] == [(2, "[20] "), (2, "[7] s")]
    for wrong in (f"takes {Figure(12)} s", "ms"):
        with pytest.raises(LookupError, match="times where once is meant"):
            list(uncovered(text, [wrong], {}))
    with pytest.raises(LookupError, match="not in the page"):
        list(uncovered(text, [], {"capped at 40 dB": ""}))


def test_a_changed_record_is_written_into_the_page() -> None:
    """Its figures, and not the words between them or where lines break."""
    text = "It takes 12\nms and 1,000 s (`run -o a`), 3 of 5."
    claim = (
        f"takes {Figure(7.25):.1f} ms and {Figure(12345):,.0f} s (`{Phrase('run -o b')}`), {Figure(-1)} of 5"
    )
    assert filled(text, [claim]) == "It takes 7.2\nms and 12,345 s (`run -o b`), -1 of 5."
