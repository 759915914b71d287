"""Files that a build makes: the parse tables, which Lark makes of the grammar, and the kernel's library."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Made(BuildHookInterface):  # type: ignore[misc, type-arg]
    """Makes ``scenelang/language/tables.json`` and the kernel's library, which are not committed."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make them; in an editable install they go where the checkout looks for them."""
        sys.path.insert(0, self.root)
        from scenelang.language.generate import make
        from scenelang.language.tables import PLACE, grammar_path, source_mark

        grammar, kernel = grammar_path(), self._kernel()
        if version == "editable":
            make(grammar, PLACE, source_mark(grammar))
            library = Path(self.root, "scenelang", "drawing", kernel.name())
            if not kernel.is_built(library):
                kernel.build(library)
            return
        self.folder = tempfile.mkdtemp()
        place = Path(self.folder, "tables.json")
        make(grammar, place, source_mark(grammar))
        target = os.environ.get("KERNEL_TARGET")  # another machine, of those of kernel/build.py
        library = Path(self.folder, kernel.name(target))
        kernel.build(library, target)
        build_data["force_include"] |= {
            str(place): "scenelang/language/tables.json",
            str(library): f"scenelang/drawing/{library.name}",
        }
        build_data["pure_python"] = False
        here = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        machine = kernel.TARGETS[target][1] if target else here
        build_data["tag"] = f"py3-none-{machine}"  # it asks nothing of Python

    def _kernel(self) -> Any:
        """The module that builds the kernel."""
        spec = importlib.util.spec_from_file_location("build_kernel", Path(self.root, "kernel", "build.py"))
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Leave nothing behind."""
        if version != "editable":
            shutil.rmtree(self.folder)
