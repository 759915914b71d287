"""Write the figures in the prose of pages from what was measured: see docs/figures.py.

python docs/make_claims.py            writes the pages
python docs/make_claims.py --check    fails where one is out of date
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from figures import filled

HERE = Path(__file__).parent


def claimed() -> Iterator[tuple[Path, ModuleType]]:
    """Every page whose figures are claimed, with its claims."""
    for path in sorted(HERE.glob("claims/*.py")):
        if path.stem != "common":
            page = HERE.parent / "README.md" if path.stem == "readme" else HERE / f"{path.stem}.md"
            yield page, importlib.import_module(f"claims.{path.stem}")


def main() -> None:
    """See the module's description."""
    for page, module in claimed():
        text = page.read_text("utf-8")
        try:
            made = filled(text, module.CLAIMS)
        except LookupError as error:
            raise SystemExit(f"{page.name}: {error}") from None
        if made != text and "--check" in sys.argv:
            raise SystemExit(f"{page.name} is out of date: python docs/make_claims.py")
        page.write_text(made, "utf-8")


if __name__ == "__main__":
    main()
