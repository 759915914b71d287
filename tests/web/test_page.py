"""The page as text: whole, inert whatever a scene's author wrote; its script, and the rows of Programs."""

from __future__ import annotations

import base64
import hashlib
import html
import io
import itertools
import json
import re
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import scenelang as nsg
from scenelang.web.arrays import MODULES, script, web
from scenelang.web.export import alternative, colour_name, page, plain, still, view_of

ODD = "</script><script>alert(1)</script><!-- ]]> [[script]] \u202e\u2066 & \" ' \u2028 \ud800"


def packed(text: str, what: str) -> str:
    """What a page holds packed: its ``view`` or its ``code``."""
    held = re.search(rf'<script type="text/plain" id="{what}">(.*?)</script>', text)
    assert held is not None
    return zlib.decompress(base64.b64decode(held[1])).decode()


def test_the_policy_allows_the_pages_own_script_and_style_alone(tmp_path: Path) -> None:
    nsg.export(nsg.loads("star;"), tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text("utf-8")
    policy = html.unescape(re.search(r'Security-Policy" content="([^"]*)"', text)[1])  # type: ignore[index]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    loader, style = (re.search(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL)[1] for tag in ("script", "style"))  # type: ignore[index]
    digests = [hashlib.sha256(one.encode()).digest() for one in (loader, packed(text, "code"), style)]
    own = [f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests]
    assert [rules["script-src"], rules["style-src"]] == [f"{own[0]} {own[1]}", own[2]]
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'none'"
    assert rules["img-src"] == "data: blob:"
    assert not re.search(r"\bsrc=(?!\"data:)|\bhref=(?!\"data:)|https?://|url\(|@import", text)
    assert not re.search(r"\son\w+=|style=", text.partition("<script")[0])


def test_what_an_author_wrote_is_inert() -> None:
    view = view_of(nsg.compile(nsg.loads("star;")), title=ODD, source=[(ODD, ODD)])
    text = page(view)
    assert len(re.findall("<script", text)) == len(re.findall("</script", text)) == 3
    assert "<!--" not in text
    assert not re.search("[\u202a-\u202e\u2066-\u2069\u2028\ud800]", text)
    assert "⟨U+202E⟩" in text
    assert json.loads(packed(text, "view"))["source"] == [{"name": ODD, "text": ODD}]
    text.replace("\ud800", "").encode()


def test_the_script_makes_no_code_and_no_markup_of_texts() -> None:
    assert not re.search(r"^\s*(import|export)\b|</script|<!--", script(), re.MULTILINE)
    assert not re.search(
        r"\beval\(|new Function|(inner|outer)HTML|insertAdjacentHTML|document\.write", script()
    )


def test_colours_have_names() -> None:
    named = {"red": (1, 0, 0), "grey": (0.5, 0.5, 0.5), "white": (1, 1, 1), "black": (0, 0, 0)}
    named |= {"blue": (0.1, 0.2, 0.9), "brown": (0.55, 0.27, 0.07), "light green": (0.7, 0.9, 0.7)}
    for name, rgb in {**named, "dark green": (0, 0.2, 0)}.items():
        assert colour_name(rgb) == name


def test_a_picture_in_words() -> None:
    def data(text: str) -> dict[str, Any]:
        return view_of(nsg.compile(nsg.loads(text))).data

    star = "background(#fff); square; subtract { star; } star { material flat { color(#00f); } }"
    told = alternative(data(star))
    assert told.startswith("A picture of a s")
    assert told.endswith("on white.")
    assert all(word in told for word in ("square", "blue"))
    holed = "subtract { square; intersect { star; union { pentagon; square; } } }"
    assert alternative(data(holed)).startswith("A picture of a square, with 3 cut-outs")
    solid = "sphere { material diffuse { color(#f00); } } torus { translate(2, 0, 0); }"
    assert alternative(data(solid)).startswith("A 3D scene of a sphere and a torus, in red")
    assert alternative(data('model "shapes2d"; background(none);')) == "An empty picture."
    moving = {**data(star), "animation": {"seconds": 4.0, "loop": True}}
    assert alternative(moving).endswith("It moves for 4 seconds, over and over.")


def test_stills_are_large_enough_to_be_read_and_small_files() -> None:
    """Whatever the canvas; lines of 0.01, five pixels of a still, are apart."""
    bar = "square { scale(0.01, 0.3); translate(0.04 * i, 0); material flat { color(#000); } }"
    bars = f"for (i in 0..<9) {{ {bar} }}"
    for side in (120, 2400):
        program = nsg.compile(nsg.loads(f"canvas({side}, {side * 2 // 3}); background(none); {bars}"))
        data = still(program)
        with Image.open(io.BytesIO(data)) as image:
            assert (image.format, image.size) == ("WEBP", (960, 640))
            alpha = image.convert("RGBA").getchannel("A")
        row = [alpha.getpixel((x, 320)) > 128 for x in range(960)]  # type: ignore[operator]
        assert sum(a != b for a, b in itertools.pairwise(row)) == 18
        assert len(data) < 8000
    with Image.open(io.BytesIO(still(nsg.compile(nsg.loads("canvas(60, 40); sphere;"))))) as image:
        assert image.size == (480, 320)


def test_controls_are_written_out() -> None:
    assert plain("a\u202eb\n\U0001f600é\x00") == "a⟨U+202E⟩b⟨U+000A⟩\U0001f600é⟨U+0000⟩"


def test_export_refuses_what_has_no_meaning(tmp_path: Path) -> None:
    program, out = nsg.compile(nsg.loads("star;")), tmp_path / "a.html"
    for arguments in ({"params": {"k": 1}}, {"root": tmp_path}, {"size": (9, 9)}, {"model": "shapes2d"}):
        with pytest.raises(ValueError, match="are for"):
            nsg.export(program, out, **arguments)  # type: ignore[arg-type]
    (tmp_path / "a.nsg").write_text("circle;")
    with pytest.raises(nsg.SceneError):
        nsg.export(tmp_path / "a.nsg", out)
    with pytest.raises(OSError, match="none"):
        nsg.export(tmp_path / "none.nsg", out)
    assert not out.exists()


def test_sources_are_named_from_the_scenes_folder(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib/dots.nsg").write_text("module dot() { star; }")
    (tmp_path / "a.nsg").write_text('import "lib/dots.nsg" as dots; import "std/shapes" as s; dots.dot();')
    nsg.export(tmp_path / "a.nsg", tmp_path / "a.html", size=(64, 32))
    text = (tmp_path / "a.html").read_text("utf-8")
    data = json.loads(packed(text, "view"))
    assert [one["name"] for one in data["source"]] == ["a.nsg", "lib/dots.nsg"]
    assert str(tmp_path) not in text
    assert data["canvas"] == [64, 32]


def test_names_at_the_top_differ() -> None:
    names = re.findall(r"^(?:async )?(?:function\*?|class|const|let) (\w+)", script(), re.MULTILINE)
    assert {name: count for name, count in Counter(names).items() if count > 1} == {}


def test_files_stand_behind_what_they_import() -> None:
    for at, name in enumerate(MODULES):
        needed = re.findall(r'from "\./(\w+)\.js"', web(f"{name}.js"))
        assert not set(needed) & set(MODULES[at:]), name
