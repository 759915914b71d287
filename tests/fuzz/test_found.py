"""What fuzzing found, one test each; the inputs themselves are in ``found/`` and run by `test_targets`."""

from __future__ import annotations

import time

from scenelang.diagnostics import render
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile
from scenelang.syntax import parse


def test_snippets_of_a_very_long_line_lay_out_only_what_is_near_their_marks() -> None:
    """Each of 200 diagnostics laid out the whole line seven times: minutes for a file of one line."""
    source = SourceFile("long.nsg", "x" * 2_000_000 + " \0" * 300 + "y" * 2_000_000)
    found = Diagnostics()
    parse(source, found)
    before = time.process_time()
    text = render.render_text(list(found))
    assert time.process_time() - before < 5
    assert max(map(len, text.splitlines())) < 200
    lines = text.splitlines()
    carets = [index for index, line in enumerate(lines) if line.endswith("^")]
    for index in carets[1:150]:  # the first caret may stand under a cut line
        marked = lines[index - 1][len(lines[index]) - 1]
        assert marked == "\N{REPLACEMENT CHARACTER}", lines[index - 1 : index + 1]
