"""Steps of mkdocs for the site beyond turning ``docs/*.md`` into pages.

- A page for each diagnostic, ``errors/E0401.html``, from ``scenelang/language/pages/E0401.md``, and the
  changelog and the contributors' guide as pages.
- What each command's ``--help`` says, as a page.
- The scenes of ``examples/`` as files to download.
- Pictures of scenes, of ``examples/`` and of blocks of ``nsg``, lead to the scenes themselves, drawn live
  (``viewers/NAME.html``); ``site.js`` opens them in the picture's place.
- Links of pages lead to files of the repository, as code hosts show them; here they lead to the same thing
  inside the site, and where the site has no such thing they become plain text.
- Nothing is fetched from elsewhere, also where the site is opened as files.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from lab.docs.blocks import pictured
from scenelang.cli.main import COMMANDS, Commands, cli
from scenelang.language.diagnostics import SourceFile
from scenelang.language.evaluation import Source
from scenelang.web.export import PagePayload, control_rows, viewed
from scenelang.web.export import page as page_of

ROOT = Path(__file__).parents[1]
STILL = re.compile(r"^sky\(", re.MULTILINE)  # whose light takes seconds to make, and so stay pictures
CODE_PAGES = "scenelang/language/pages"
ROOT_PAGES = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
COMMANDS_PAGE = "commands.md"
_LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_SHIM = re.compile(r"<script src=\"?https://unpkg\.com/iframe-worker/shim\"?></script>")
_CODES = re.compile(r"^(```nsg)(?: [EW]\d{4})+", re.MULTILINE)  # the codes that a test expects of a scene
_PICTURE = re.compile(r"(\[)?(!\[[^\]]*\]\((?:\.\./)*pictures/([\w/-]+)\.(?:png|webp)\))(?(1)\]\([^)]*\))")
_SHOWN = re.compile(r"^// Shown( \w+)?:", re.MULTILINE)
LIVE: dict[str, str] = {}
"""Attributes of links to the pages that draw scenes, by the names of their pictures: lines of controls, 16 px
each, and the height of the picture by its width."""
_FENCE = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Leave pages that are not written yet out of the navigation."""
    config.nav = _existing(config.nav or [])
    return config


def _existing(entries: list[Any]) -> list[Any]:
    kept = []
    for entry in entries:
        ((title, goal),) = entry.items()
        if isinstance(goal, list):
            inner = _existing(goal)
            kept += [{title: inner}] if inner else []
        elif (ROOT / "docs" / goal).exists() or goal in (COMMANDS_PAGE, *ROOT_PAGES.values()):
            kept.append(entry)
    return kept


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what comes from elsewhere in the repository."""
    made = {target: ROOT / source for source, target in ROOT_PAGES.items()}
    made |= {f"errors/{path.name}": path for path in sorted((ROOT / CODE_PAGES).glob("[EW]*.md"))}
    for path in sorted((ROOT / "examples").rglob("*")):
        if path.suffix in (".nsg", ".py"):
            made[path.relative_to(ROOT).as_posix()] = path
    for target, path in made.items():
        files.append(File.generated(config, target, content=path.read_bytes()))
    for name, scene in live_scenes().items():
        if STILL.search(scene if isinstance(scene, str) else scene.read_text("utf-8")):
            continue
        view = view_of_scene(scene)
        width, height = view.data["canvas"]
        LIVE[name] = f"data-rows={control_rows(view)} data-aspect={height / width:.4f}"
        files.append(File.generated(config, f"viewers/{name}.html", content=page_of(view, embedded=True)))
    files.append(File.generated(config, COMMANDS_PAGE, content=commands_page()))
    return files


def live_scenes() -> dict[str, str | Path]:
    """The texts or files of scenes, by the pictures that show them."""
    found: dict[str, str | Path] = {path.stem: path for path in (ROOT / "examples").glob("*.nsg")}
    for path in (ROOT / "examples/reference").glob("*.nsg"):
        shown = _SHOWN.findall(path.read_text("utf-8"))
        found |= {f"language/{name.strip() or path.stem}": path for name in shown}
    for page in (ROOT / "docs").glob("*.md"):
        shown = pictured(page.read_text("utf-8"))
        found |= {name.rpartition(".")[0]: text for text, name in shown}
    return found


def view_of_scene(scene: str | Path) -> PagePayload:
    """The scene of a page, from a text or a file."""
    if isinstance(scene, Path):
        return viewed(Source(scene, root=ROOT / "examples"), scene.stem)[0]
    return viewed(Source(text=SourceFile("scene.nsg", scene), root=ROOT / "examples"), "scene")[0]


def commands_page() -> str:
    """Every command with the text of its ``--help``."""
    parts = ["# Commands\n\nWhat `scenelang COMMAND --help` says.\n"]
    parts += _told(cli, "scenelang")
    return "\n".join(parts)


def _told(group: Commands, path: str) -> Iterator[str]:
    for name, summary in COMMANDS.items():
        command = group.get_command(click.Context(group), name)
        assert command is not None, name
        context = click.Context(command, info_name=f"{path} {name}", terminal_width=100)
        title = f"{path} {name}".removeprefix("scenelang ")
        yield f"## {title}\n\n{summary}\n\n```text\n{command.get_help(context)}\n```\n"
        if isinstance(command, Commands):
            yield from _told(command, f"{path} {name}")


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links into the repository into links into the site."""
    place = _origin(page.file.src_uri).parent

    def link(match: re.Match[str]) -> str:
        text, target = match.groups()
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        path, hash_sign, anchor = target.partition("#")
        goal = (ROOT / place / path).resolve()
        inside = _in_site(goal)
        if inside is None or files.get_file_from_path(inside) is None:
            return text
        up = "../" * page.file.src_uri.count("/")
        return f"[{text}]({up}{inside}{hash_sign}{anchor})"

    def alive(match: re.Match[str]) -> str:
        up = "../" * page.file.src_uri.count("/")
        if (sizes := LIVE.get(match[3])) is None:
            return match[0]
        return f"[{match[2]}]({up}viewers/{match[3]}.html){{.live {sizes}}}"

    markdown = _PICTURE.sub(alive, markdown)
    parts = _FENCE.split(_CODES.sub(r"\1", markdown))
    return "".join(part if part.startswith("```") else _LINK.sub(link, part) for part in parts)


def on_post_page(output: str, *, page: Page, config: MkDocsConfig) -> str:
    """Take out the one script that the offline plugin would fetch from elsewhere."""
    return _SHIM.sub("", output)


def on_post_template(output_content: str, *, template_name: str, config: MkDocsConfig) -> str:
    """As `on_post_page`, for the page of what is not found."""
    return _SHIM.sub("", output_content)


def _origin(uri: str) -> Path:
    """The file of the repository that a page of the site comes from."""
    for source, target in ROOT_PAGES.items():
        if uri == target:
            return Path(source)
    if re.fullmatch(r"errors/[EW]\d{4}\.md", uri):
        return Path(CODE_PAGES) / Path(uri).name
    return Path("docs") / uri


def _in_site(goal: Path) -> str | None:
    """The place of a file of the repository in the site."""
    if not goal.is_relative_to(ROOT):
        return None
    path = goal.relative_to(ROOT)
    if path.as_posix() == "README.md":
        return "index.md"
    if path.as_posix() in ROOT_PAGES:
        return ROOT_PAGES[path.as_posix()]
    if path.is_relative_to(CODE_PAGES):
        return f"errors/{path.name}"
    if path.is_relative_to("docs"):
        return path.relative_to("docs").as_posix()
    return path.as_posix()
