"""Diagnostics in every format; each takes any number of them, in any order, and gives one text."""

from scenelang.diagnostics.render_machine import render_concise as render_concise
from scenelang.diagnostics.render_machine import render_github as render_github
from scenelang.diagnostics.render_machine import render_json as render_json
from scenelang.diagnostics.render_machine import render_sarif as render_sarif
from scenelang.diagnostics.render_text import render_text as render_text

__all__ = ["render_concise", "render_github", "render_json", "render_sarif", "render_text"]
