"""Write the figures in the prose of pages from what was measured: see lab/docs/figures.py.

python -m lab docs claims            writes the pages
python -m lab docs claims --check    fails where one is out of date
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from lab import DOCS, ROOT
from lab.docs.figures import filled


def claimed() -> Iterator[tuple[Path, ModuleType]]:
    """Every page whose figures are claimed, with its claims."""
    for path in sorted(Path(__file__).parent.glob("claims/*.py")):
        if path.stem not in ("common", "__init__"):
            page = ROOT / "README.md" if path.stem == "readme" else DOCS / f"{path.stem}.md"
            yield page, importlib.import_module(f"lab.docs.claims.{path.stem}")


def main() -> None:
    for page, module in claimed():
        text = page.read_text("utf-8")
        try:
            made = filled(text, module.CLAIMS)
        except LookupError as error:
            raise SystemExit(f"{page.name}: {error}") from None
        if made != text and "--check" in sys.argv:
            raise SystemExit(f"{page.name} is out of date: python -m lab docs claims")
        page.write_text(made, "utf-8")


if __name__ == "__main__":
    main()
