"""The page: a view and all that draws it in one HTML file, which asks for nothing else."""

from __future__ import annotations

import base64
import hashlib
import re
import unicodedata
from html import escape
from importlib.metadata import version
from math import ceil
from typing import Any, Final

from scenelang.viewer.script import script, web
from scenelang.viewer.store import packed
from scenelang.viewer.view import View

MOST_TITLE: Final = 200
_POLICY: Final = (
    "default-src 'none'; script-src '{loader}' '{code}'; style-src '{style}'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'"
)
_SLOT: Final = re.compile(r"\[\[(\w+)\]\]")
_COMMENT: Final = re.compile(r"^ *(?:/\*\*.*?\*/|//[^\n]*)\n", re.MULTILINE | re.DOTALL)


def page(view: View, *, still: bytes = b"", embedded: bool = False) -> str:
    """An HTML file that draws a view; nothing in it comes from elsewhere, and its policy allows nothing to.

    Args:
        view: what it shows.
        still: a WebP for browsers without WebGL2 or JavaScript.
        embedded: leave out heading, sources and licences, for a frame in another page.
    """
    data = view.data
    width, height = data["canvas"]
    sizes = f":root{{--aspect:{width / height:.6f};--controls:{control_rows(view)}rem}}\n"
    style = sizes + web("controls.css") + web("page.css")
    code, loader = f"{_COMMENT.sub('', script())}\nopenPage();\n", web("loader.js")
    alt = escape(plain(data["alt"]))
    drawn = base64.b64encode(still).decode()
    image = '<i id="still"></i>'
    if still:
        image = f'<img id="still" src="data:image/webp;base64,{drawn}" alt="{alt}">'
    parts = {
        "policy": escape(_POLICY.format(loader=_digest(loader), code=_digest(code), style=_digest(style))),
        "version": escape(version("scenelang")),
        "title": escape(plain(data["title"])[:MOST_TITLE] or "scene"),
        "style": style,
        "kind": "embedded" if embedded else "whole",
        "still": image,
        "width": str(width),
        "height": str(height),
        "alt": alt,
        "model": told(data["model"]),
        "view": packed(view.message().encode()),
        "code": packed(code.encode()),
        "loader": loader,
    }
    return _SLOT.sub(lambda slot: parts[slot[1]], web("page.html"))


def control_rows(view: View) -> int:
    """About how high the controls of a view are, in rem."""
    data = view.data
    fixed = {one["name"] for one in data["fixed"]}
    live = [param for param in data["params"] if param["name"] not in fixed]
    told = sum("label" in param for param in live)
    timeline, camera = bool(data["animation"]), bool(data["dimension"] == 3)
    return ceil(2.5 * len(live) + 1.5 * told + 2 * len(fixed) + 3 * bool(live) + 3 * timeline + 6 * camera)


def plain(text: str) -> str:
    """A text whose controls, marks of direction among them, are written out, such as ⟨U+202E⟩."""
    hidden = ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")
    return "".join(f"⟨U+{ord(c):04X}⟩" if unicodedata.category(c) in hidden else c for c in text)


def told(model: dict[str, Any]) -> str:
    """What the page says of its model, as HTML."""
    name, summary = (f"<bdi>{escape(plain(model[key]))}</bdi>" for key in ("name", "summary"))
    line = f"Drawn by the neural network {name} ({summary})"
    figures = model.get("measured") or {}
    if "flip" in figures:
        line += (
            f", which on {figures['scenes']} random scenes was {figures['psnr']:.1f} dB (PSNR, counted up to "
            f"{figures['cap']:g}) and {figures['flip']:.4f} (mean FLIP) from the exact picture"
        )
    return f"{line}."


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
