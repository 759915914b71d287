"""The documentation is true: its scenes, commands, links, Python and pictures are tried."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

import scenelang
from lab.cli import command as command_of_lab
from scenelang.cli.main import cli
from scenelang.compiler.compile import find_model
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.words import SOLID_TRANSFORMS, TOKENS, TRANSFORMS

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "tests").rglob("*.md")])
README = (ROOT / "README.md").read_text("utf-8")
VENV = ".venv/bin/"
PROGRAMS = {"python3", "python", "pip", "pytest", "ruff", "mypy", "bash", "git", "scenelang"}


def blocks() -> Iterator[tuple[str, str, tuple[str, ...], str]]:
    """Place, language, further words of the head, and text of each block of code of the pages."""
    for page in PAGES:
        text = page.read_text("utf-8")
        for match in re.finditer(r"^```([^\n]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
            language, *words = match[1].split() or [""]
            place = f"{page.relative_to(ROOT)}:{text[: match.start()].count(chr(10)) + 1}"
            yield place, language, tuple(w for w in words if not w.startswith("title=")), match[2]


def test_scenes_give_what_the_page_says() -> None:
    """A block of ``nsg`` has no errors, one of ``nsg E0402 …`` those that it names; JSON is JSON."""
    wrong = []
    for place, language, words, text in blocks():
        if language == "nsg":
            found = Diagnostics()
            scene, spans = Source(text=SourceFile(place, text), root=ROOT / "examples").scene(found)
            manifest = None if scene is None else find_model(scene, found, spans=spans)
            if scene is not None and manifest is not None:
                check_scene(scene, spans, found, manifest)
            if (codes := tuple(d.code for d in found.errors)) != words:
                wrong.append(f"{place}: {codes}")
        elif language == "json":
            try:
                json.loads(text)
            except ValueError as error:
                wrong.append(f"{place}: {error}")
        elif language not in {"sh", "python", "text"}:
            wrong.append(f"{place}: a block of `{language}`")
    assert not wrong, "\n".join(wrong)


def test_commands_name_what_exists() -> None:
    """Scripts and files exist; subcommands and options are ones that `scenelang` or the laboratory has."""
    commands = [
        (place, part.strip())
        for place, language, _, text in blocks()
        for line in text.splitlines()
        for part in re.split(r"&&|\|", line.split(" #")[0])
        if part.strip() and language == "sh"
    ]
    helps: dict[tuple[bool, str], str] = {}
    for place, command in commands:
        words = shlex.split(command)
        output = {words[i + 1] for i, word in enumerate(words[:-1]) if word == "-o"}
        for word in words[1:]:
            if word.startswith(("examples/", "docs/", "tests/", "lab/", ".ci/")) and word not in output:
                assert (ROOT / word).exists(), f"{place}: {word}"
        program = words[0].removeprefix(VENV)
        assert program in PROGRAMS, place
        if program == "scenelang" or words[1:3] == ["-m", "lab"]:
            ours = program == "scenelang"
            subcommand, *rest = words[1 if ours else 3 :]
            if (ours, subcommand) not in helps:
                shown = CliRunner().invoke(cli if ours else command_of_lab, [subcommand, "--help"])
                assert shown.exit_code == 0, f"{place}: {shown.output}"
                helps[ours, subcommand] = shown.output
            for word in rest if subcommand not in ("bench", "docs") else ():
                if re.match(r"-{1,2}[A-Za-z]", word):
                    option = rf"(?<!\S){re.escape(word.partition('=')[0])}\b"
                    assert re.search(option, helps[ours, subcommand]), f"{place}: {word}"


def test_python_of_the_readme_runs(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (code,) = [
        code for place, language, _, code in blocks() if (place[:9], language) == ("README.md", "python")
    ]
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "chain.png").stat().st_size > 1000
    assert "star {" in done.stdout


def headings(page: Path) -> set[str]:
    """Anchors of a page, as code hosts make them."""
    titles = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def test_links_lead_somewhere() -> None:
    for page in PAGES:
        text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", text)):
            if re.match(r"https?://", target):
                continue
            path, _, anchor = target.partition("#")
            goal = (page.parent / path).resolve() if path else page
            assert goal.exists(), f"{page.name}: {target}"
            assert goal.is_relative_to(ROOT), f"{page.name}: {target}"
            assert not anchor or anchor in headings(goal), f"{page.name}: {target}"


def test_ci_runs_the_commands_of_the_readme() -> None:
    """Each is one line, and `.ci/run` takes it from the README by a pattern that only it matches."""
    script = (ROOT / ".ci/run").read_text("utf-8")
    patterns = re.findall(r"grep -m1 '(\^python3[^']*)' README\.md", script)
    assert len(patterns) == 2
    for pattern in patterns:
        assert len(re.findall(pattern + ".*" * (not pattern.endswith("$")), README, re.MULTILINE)) == 1
    assert 'bash -c "$render"' in script
    assert 'bash -c "$tests"' in script


def test_every_picture_is_made_and_used() -> None:
    """By the one script, which knows what it would draw without drawing it; and all of them are small."""
    from lab.docs import make_pictures as script

    folder = ROOT / "docs/pictures"
    files = [path for path in folder.rglob("*") if path.is_file()]
    names = {path.relative_to(folder).as_posix() for path in files}
    assert names == {*script.plan(), *script.RECORDED}
    text = "".join(page.read_text("utf-8") for page in PAGES)
    used = set(re.findall(r"\]\((?:docs/)?pictures/([^)\s]+)\)", text))
    stills_of_moving = {f"{name.removesuffix('.webp')}.png" for name in names if name.endswith(".webp")}
    assert names - used <= stills_of_moving
    assert sum(path.stat().st_size for path in files) < 6_400_000


def test_every_example_is_shown() -> None:
    page = (ROOT / "docs/examples.md").read_text("utf-8")
    files = (ROOT / "examples").glob("*.*")
    for path in (file for file in files if file.suffix != ".safetensors"):  # what scenes import
        assert f"(../examples/{path.name})" in page, path.name


def test_every_transform_operator_and_colour_is_pictured() -> None:
    """All that a shipped model can draw."""
    page = (ROOT / "docs/language.md").read_text("utf-8")
    manifest = load_manifest("shapes2d")
    flat = TRANSFORMS.keys() - {*SOLID_TRANSFORMS}
    # of the texture operations, those that show in `flat`
    for name in {*flat, "color", "grayscale", "hue", *TOKENS, *manifest.materials, "group", "chain"}:
        assert f"(pictures/language/{name}.png)" in page, name
    pictured = re.search(r"!\[(.*)\]\(pictures/language/leaves.png\)", page)
    assert pictured is not None
    assert all(geometry in pictured[1] for geometry in manifest.geometries)


def test_every_page_is_linked() -> None:
    """From the README, the site's navigation, or a page that these link."""
    nav = re.findall(r"^\s*- .*: ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    seen, todo = set(), [ROOT / "README.md", *(ROOT / "docs" / page for page in nav)]
    todo = [page for page in todo if page.exists()]
    while todo:
        page = todo.pop()
        if page in seen:
            continue
        seen.add(page)
        targets = re.findall(r"\]\(([^)#\s]+\.md)", page.read_text("utf-8"))
        todo += [(page.parent / target).resolve() for target in targets]
    assert set(PAGES) <= seen


def build_site(folder: Path) -> None:
    """Build it into a folder, without a warning."""
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-f", ROOT / "mkdocs.yml"]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(
        [*build, "-d", folder], capture_output=True, text=True, check=False, env=environment
    )
    assert built.returncode == 0, built.stderr


@pytest.mark.more
def test_site_is_built(tmp_path: Path) -> None:
    """Nothing in it is fetched from elsewhere."""
    build_site(tmp_path)
    for page in tmp_path.rglob("*.html"):
        fetched = re.findall(
            r"<(?:script|img|iframe|link)[^>]*(?:src|href)=\"?((?:https?:)?//[^\"> ]*)",
            page.read_text("utf-8"),
        )
        assert not fetched, f"{page.name}: {fetched}"


def test_every_public_name_is_in_the_embedding_guide() -> None:
    page = (ROOT / "docs/embedding.md").read_text("utf-8")
    assert [name for name in scenelang.__all__ if f"`{name}`" not in page] == []


def test_tables_of_results_are_those_of_the_measurements() -> None:
    """`python -m lab docs results` would change nothing."""
    from lab.docs.make_results import PAGE, filled

    text = PAGE.read_text("utf-8")
    assert filled(text) == text


def test_readme_says_how_deep_booleans_nest() -> None:
    """As deep as the page says a scene is without mistakes; one operand within another more is not."""
    said = re.search(r"Booleans nest up to (\d+) deep", README)
    assert said is not None

    def nested(depth: int) -> set[str]:
        text = "star { scale(0.5); }"
        for _ in range(depth):
            text = f"subtract {{ square {{ scale(0.9); }} {text} }}"
        found = scenelang.check_text(f"subtract {{ square; {text} }}")
        return {d.code for d in found if d.severity == "error"}

    assert [nested(int(said[1])), nested(int(said[1]) + 1)] == [set(), {"E0409"}]
