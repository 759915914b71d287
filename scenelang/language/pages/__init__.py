"""A page for every code, ``E0101.md``: what it means, why, an example, and what to write instead.

A page is plain Markdown with a fixed shape, so that it serves three readers: `scenelang explain`, the
documentation site (which renders each file of this folder as ``errors/CODE.html``; ``docs/errors.md`` is the
index), and the tests, which run every example.

- The first line is ``# CODE: title``. Codes are stable and never reused.
- A title that begins with ``retired:`` is of a code that is not given any more; its examples are good ones.
- The sections ``## Why``, ``## Example`` and ``## Instead`` follow the paragraph that says what it is.
- A fence ``nsg {.bad}`` gives exactly this code, ``nsg {.good}`` nothing at all; ``json`` is a Scene for
  `scenelang.language.scene`, ``python`` is run and raises `SceneError`.
- A fence ``nsg title="parts.nsg"`` is a file beside all examples of the page, which are ``scene.nsg``.
- A ``sh`` fence behind an example is the command that checks it; its options count.
- ``<!-- with scenelang.module.LIMIT = 3 -->`` before an example lowers limits that it is too short to reach.

No page is read before it is asked for.
"""

from __future__ import annotations

import re
import shlex
import textwrap
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Final, Literal

from scenelang.assets.records import Record

AREAS: Final = {
    "01": "syntax",
    "02": "names",
    "03": "types and values",
    "04": "graph and booleans",
    "05": "what a model can do",
}
_NAMES = (page.name.removesuffix(".md") for page in files(__name__).iterdir() if page.name[-3:] == ".md")
CODES: Final = tuple(sorted(_NAMES, key=lambda code: (code[1:3], code)))
"""All codes, area by area, errors first."""
_FENCE: Final = re.compile(
    r"(?:^<!-- with (?P<limits>[^\n]*) -->\n)?^```(?P<info>[^\n]*)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


class Example(Record):
    kind: Literal["bad", "good"]  # ``bad`` gives the page's code and nothing else, ``good`` nothing
    language: str  # ``nsg``, ``json`` or ``python``
    text: str
    options: tuple[str, ...] = ()  # what `scenelang check` is told besides, as words
    limits: tuple[tuple[str, int], ...] = ()  # limits that are lowered for it, by their dotted names


class Page(Record):
    code: str  # such as ``E0302``
    text: str  # the Markdown, with its first line
    examples: tuple[Example, ...]  # in the order of the page
    files: tuple[tuple[str, str], ...]  # names and texts of files beside the examples

    @property
    def title(self) -> str:
        return self.text.partition("\n")[0].partition(": ")[2]

    @property
    def severity(self) -> str:
        return "warning" if self.code.startswith("W") else "error"

    @property
    def area(self) -> str:
        return AREAS[self.code[1:3]]

    @property
    def meaning(self) -> str:
        """Meaning of the code: all between the title and the first section."""
        return self.text.partition("\n")[2].partition("\n## ")[0].strip()

    def plain(self, width: int = 96, paint: Callable[[str, str], str] = lambda text, style: text) -> str:
        """The page without its Markdown, coloured by ``paint`` in styles of `reports`."""
        blocks = [paint(f"{self.severity}[{self.code}]", self.severity) + paint(f": {self.title}", "bold")]
        text = re.sub(r"^<!--.*-->\n", "", self.text.partition("\n")[2], flags=re.MULTILINE)
        for part in re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL):
            if part.startswith("```"):
                info, _, code = part.removesuffix("```").partition("\n")
                title = re.search(r'title="([^"]+)"', info)
                named = "    " + paint(f"{title[1]}:", "frame") + "\n" if title else ""
                blocks.append(named + textwrap.indent(code.rstrip("\n"), "    "))
                continue
            for paragraph in part.strip().split("\n\n"):
                if paragraph.startswith("## "):
                    blocks.append(paint(paragraph[3:], "bold"))
                elif paragraph:
                    prose = re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", paragraph)
                    filled = textwrap.fill(prose, width, break_long_words=False, break_on_hyphens=False)
                    blocks.append(re.sub(r"`[^`\n]+`", lambda code: paint(code[0], "frame"), filled))
        return "\n\n".join(blocks) + "\n"


@cache
def read_page(code: str) -> Page:
    """The page of a code.

    Raises:
        KeyError: there is no such code.
    """
    if code not in CODES:
        raise KeyError(code)
    text = (files(__name__) / f"{code}.md").read_text("utf-8")
    examples: list[Example] = []
    beside: list[tuple[str, str]] = []
    for fence in _FENCE.finditer(text):
        language, _, info = fence["info"].partition(" ")
        if title := re.fullmatch(r'title="([^"]+)"', info):
            beside.append((title[1], fence["text"]))
        elif info in ("{.bad}", "{.good}"):
            limits = [item.split("=") for item in (fence["limits"] or "").split(",") if item]
            lowered = tuple((name.strip(), int(value)) for name, value in limits)
            kind: Literal["bad", "good"] = "bad" if info == "{.bad}" else "good"
            examples.append(Example(kind, language, fence["text"], (), lowered))
        elif language == "sh" and examples:
            last = examples[-1]
            options = tuple(shlex.split(fence["text"])[3:])
            examples[-1] = Example(last.kind, last.language, last.text, options, last.limits)
    return Page(code, text, tuple(examples), tuple(beside))
