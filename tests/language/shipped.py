"""The scenes that people copy: examples, and the blocks of the documentation.

    python -m tests.language.shipped

formats them all.
"""

from __future__ import annotations

import re
from pathlib import Path

from scenelang.language.formatting import format_text
from scenelang.language.reports import SceneError

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").rglob("*.nsg"))
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
_BLOCK = re.compile(r"^(```nsg[^\n]*\n)(.*?)^(```)$", re.MULTILINE | re.DOTALL)


def formatted_page(text: str) -> str:
    """A page with its scenes formatted; those that show syntax mistakes stay."""

    def block(match: re.Match[str]) -> str:
        try:
            return match[1] + format_text(match[2]) + match[3]
        except SceneError:
            return match[0]

    return _BLOCK.sub(block, text)


def main() -> None:
    for path in (*EXAMPLES, *PAGES):
        text = path.read_text("utf-8")
        result = format_text(text) if path.suffix == ".nsg" else formatted_page(text)
        if result != text:
            path.write_text(result, "utf-8")
            print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
