"""The laboratory: what measures models, compares designs and trains. The package imports nothing of it."""

from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]  # of the repository
DOCS: Final = ROOT / "docs"
RESULTS: Final = DOCS / "results"
