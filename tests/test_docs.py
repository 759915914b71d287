"""The documentation is true: its scenes, commands, links, Python and pictures are tried."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
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


@dataclass(frozen=True)
class Block:
    """A fenced block of code of a page."""

    page: str
    line: int
    language: str
    words: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def blocks() -> list[Block]:
    found = []
    for page in PAGES:
        text = page.read_text("utf-8")
        for match in re.finditer(r"^```([^\n]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
            head = match[1].split()
            line = text[: match.start()].count("\n") + 1
            name = str(page.relative_to(ROOT))
            words = tuple(word for word in head[1:] if not word.startswith("title="))
            found.append(Block(name, line, head[0] if head else "", words, match[2]))
    return found


BLOCKS = blocks()


def of(language: str) -> list[Block]:
    return [block for block in BLOCKS if block.language == language]


def errors_of(block: Block) -> tuple[str, ...]:
    """Codes of the errors in a block of ``nsg``."""
    found = Diagnostics()
    source = SourceFile(str(block), block.text)
    scene, spans = Source(text=source, root=ROOT / "examples").scene(found)
    manifest = None if scene is None else find_model(scene, found, spans=spans)
    if scene is not None and manifest is not None:
        check_scene(scene, spans, found, manifest)
    return tuple(d.code for d in found.errors)


def test_scenes_give_what_the_page_says() -> None:
    """A block of ``nsg`` has no errors, one of ``nsg E0402 …`` those that it names; JSON is JSON."""
    wrong = [f"{b}: {found}" for b in of("nsg") if (found := errors_of(b)) != b.words]
    for block in of("json"):
        try:
            json.loads(block.text)
        except ValueError as error:
            wrong.append(f"{block}: {error}")
    assert not wrong, "\n".join(wrong)


def test_blocks_say_their_language() -> None:
    assert not [
        str(block) for block in BLOCKS if block.language not in {"nsg", "sh", "python", "text", "json"}
    ]


def commands() -> list[tuple[str, str]]:
    """(place, command) of every line of every ``sh`` block, split at ``&&``."""
    return [
        (str(block), part.strip())
        for block in of("sh")
        for line in block.text.splitlines()
        for part in re.split(r"&&|\|", line.split(" #")[0])
        if part.strip()
    ]


@cache
def help_of(program: str, subcommand: str) -> str:
    shown = CliRunner().invoke(cli if program == "scenelang" else command_of_lab, [subcommand, "--help"])
    assert shown.exit_code == 0, shown.output
    return shown.output


def test_commands_name_what_exists() -> None:
    """Scripts and files exist; subcommands and options are ones that `scenelang` or the laboratory has."""
    for place, command in commands():
        words = shlex.split(command)
        output = {words[i + 1] for i, word in enumerate(words[:-1]) if word == "-o"}
        for word in words[1:]:
            if word.startswith(("examples/", "docs/", "tests/", "lab/", ".ci/")) and word not in output:
                assert (ROOT / word).exists(), f"{place}: {word}"
        program = words[0].removeprefix(VENV)
        assert program in PROGRAMS, place
        if program == "scenelang" or words[1:3] == ["-m", "lab"]:
            first = 1 if program == "scenelang" else 3
            options = help_of("scenelang" if program == "scenelang" else "lab", words[first])
            for word in words[first + 1 :] if words[first] not in ("bench", "docs") else ():
                if re.match(r"-{1,2}[A-Za-z]", word):
                    name = word.partition("=")[0]
                    assert re.search(rf"(?<!\S){re.escape(name)}\b", options), f"{place}: {word}"


@pytest.mark.parametrize("block", [b for b in of("python") if b.page == "README.md"], ids=str)
def test_python_runs(block: Block, tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", block.text],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
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
    assert sum(path.stat().st_size for path in files) < 5_700_000


def test_every_example_is_shown() -> None:
    page = (ROOT / "docs/examples.md").read_text("utf-8")
    files = (ROOT / "examples").glob("*.*")
    for path in (file for file in files if file.suffix != ".safetensors"):  # what scenes import
        assert f"(../examples/{path.name})" in page, path.name


def test_every_transform_operator_and_colour_is_pictured() -> None:
    """All that a shipped model can draw."""
    page = (ROOT / "docs/language.md").read_text("utf-8")
    manifest = load_manifest("shapes2d")
    colours = {"color", "grayscale", "hue"}  # the texture transforms have nothing to move in `flat`
    names = {
        *TRANSFORMS.keys() - {*SOLID_TRANSFORMS},
        *colours,
        *TOKENS,
        *manifest.materials,
        "group",
        "chain",
    }
    for name in names:
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
    command = [sys.executable, "-m", "lab", "docs", "results", "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


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
