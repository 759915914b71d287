"""The files of the page's script share one scope."""

from __future__ import annotations

import re
from collections import Counter

from scenelang.web.arrays import MODULES, script, web


def test_names_at_the_top_differ() -> None:
    names = re.findall(r"^(?:async )?(?:function\*?|class|const|let) (\w+)", script(), re.MULTILINE)
    assert {name: count for name, count in Counter(names).items() if count > 1} == {}


def test_files_stand_behind_what_they_import() -> None:
    for at, name in enumerate(MODULES):
        needed = re.findall(r'from "\./(\w+)\.js"', web(f"{name}.js"))
        assert not set(needed) & set(MODULES[at:]), name
