"""Every code has a page; its bad examples give exactly that code, and its good ones nothing at all."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

import scenelang.language.recovery  # which takes its limit from `lexer` when it is imported
from lab.docs.make_errors import index
from scenelang.cli.main import cli
from scenelang.compiler import lower
from scenelang.language import lexer, limits, modifiers, parser, session, values
from scenelang.language import scene as schema
from scenelang.language import values as functions
from scenelang.language.pages import AREAS, CODES, Example, Page, read_page
from scenelang.language.reports import SceneError, render_text
from scenelang.language.tables import tables

PAGES = Path(scenelang.__file__).parent / "language/pages"
INDEX = (Path(__file__).parents[2] / "docs/errors.md").read_text("utf-8")


def check(example: Example, page: Page) -> list[str]:
    """Codes of what there is to say about an example."""
    if example.language == "python":
        try:
            exec(compile(example.text, page.code, "exec"), {})
        except SceneError as error:
            return [d.code for d in error.diagnostics]
        return []
    scene = f"scene.{example.language}"
    for name, text in ((scene, example.text), *page.files):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(text, "utf-8")
    result = CliRunner().invoke(cli, ["check", scene, *example.options, "--format", "json"])
    return [d["code"] for d in json.loads(result.stdout)["diagnostics"]]


EXAMPLES = [
    pytest.param(example, page, id=f"{page.code}-{example.kind}{index}")
    for page in map(read_page, CODES)
    for index, example in enumerate(page.examples)
]


@pytest.mark.parametrize(("example", "page"), EXAMPLES)
def test_example(example: Example, page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, value in example.limits:
        monkeypatch.setattr(name, value)
    assert check(example, page) == ([page.code] if example.kind == "bad" else [])


def test_codes_are_those_of_the_pages() -> None:
    assert sorted(CODES) == sorted(path.stem for path in PAGES.glob("*.md"))
    assert all(re.fullmatch(r"[EW]0[1-5]\d\d", code) for code in CODES)


@pytest.mark.parametrize("page", [*map(read_page, CODES)], ids=lambda page: page.code)
def test_shape_of_a_page(page: Page) -> None:
    assert page.text.startswith(f"# {page.code}: {page.title}\n\n")
    assert re.findall(r"^## (.*)$", page.text, re.MULTILINE) == ["Why", "Example", "Instead"]
    kinds = [example.kind for example in page.examples]
    assert kinds == sorted(kinds), "bad examples come before good ones"
    assert set(kinds) == ({"good"} if page.title.startswith("retired: ") else {"bad", "good"})
    assert page.text.count("```") == 2 * (
        len(page.examples) + len(page.files) + sum(bool(e.options) for e in page.examples)
    ), "a fence that means nothing"
    prose = re.sub(r"```.*?```", "", page.text, flags=re.DOTALL)
    assert 200 < len(prose) < 1500
    assert all(len(line) <= 110 for line in page.text.splitlines())
    assert page.area in AREAS.values()


def test_a_scene_that_is_flat_and_solid_is_shown_where_these_part() -> None:
    for model, label in (("", "square"), ('model "shapes2d";\n', 'model "shapes2d";')):
        (only,) = scenelang.check_text(f"{model}square {{ scale(0.5); }}\nsphere {{ scale(0.3); }}\n")
        assert only.message == "geometry `sphere` belongs to solid scenes, and this one is flat"
        assert [only.span and only.span.text, only.labels[0].span.text] == ["sphere", label]
        assert only.labels[0].message == "flat by this"


def test_pages_state_the_lists_and_limits_of_the_code() -> None:
    def prose(code: str) -> str:
        return " ".join(read_page(code).text.split())

    words = {text for text in tables().literals if text[0].isalpha()} - {"step", "as"}
    assert set(re.findall(r"`(\w+)`", read_page("E0110").meaning)) == words
    listed = re.search(r"The functions are `([^`]*)`", prose("E0207"))
    assert listed is not None
    assert set(listed[1].split()) == set(functions.FUNCTIONS)
    for code, number in {
        "E0120": f"{parser.MAX_DEPTH} levels",
        "E0121": f"more than {lexer.MAX_MISTAKES} syntax",
        "E0311": f"above {modifiers.MAX_SIDE_PX}",
        "E0320": f"{limits.MAX_OBJECTS:,} objects",
        "E0321": f"{limits.MAX_DEPTH} deep, or groups more than {schema.MAX_NODE_DEPTH}",
        "E0322": f"{limits.MAX_STEPS // 1_000_000} million steps",
        "E0323": f"nest more than {values.MAX_VECTOR_DEPTH} deep, or `+` makes a text",
        "E0324": f"{limits.MAX_BYTES // 1_000_000} MB, or imports nest more than {session.MAX_IMPORT_DEPTH}",
        "E0405": f"{lower.MAX_DEPTH:,} levels",
    }.items():
        assert number in prose(code), code


def test_the_index_is_made_from_the_pages() -> None:
    """`python -m lab docs errors` writes it anew."""
    assert index() == INDEX
    assert set(re.findall(r"^\| \[([EW]\d{4})\]", INDEX, re.MULTILINE)) == set(CODES)


def test_the_sample_is_what_is_printed() -> None:
    sample = re.search(r"```text\n(.*?)```", INDEX, re.DOTALL)
    assert sample is not None
    found = scenelang.check_text("square { rotate(45); }\n", name="scene.nsg")
    assert render_text(found, summary=False) == sample[1]
