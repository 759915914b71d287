"""The parse tables of a wheel, which Lark makes of the grammar."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Tables(BuildHookInterface):  # type: ignore[misc, type-arg]
    """Makes ``scenelang/language/tables.json``, which is not committed."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make them; in an editable install they go where the checkout looks for them."""
        sys.path.insert(0, self.root)
        from scenelang.language.generate import make
        from scenelang.language.tables import PLACE, grammar_path, source_mark

        grammar = grammar_path()
        if version == "editable":
            make(grammar, PLACE, source_mark(grammar))
            return
        self.folder = tempfile.mkdtemp()
        place = Path(self.folder, "tables.json")
        make(grammar, place, source_mark(grammar))
        build_data["force_include"][str(place)] = "scenelang/language/tables.json"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Leave nothing behind."""
        if version != "editable":
            shutil.rmtree(self.folder)
