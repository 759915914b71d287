"""Corners of the language in a page: scopes, modules, chains, imports, files of elements."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from scenelang.language.diagnostics import SourceFile
from scenelang.language.reports import SceneError
from tests.language.test_elements import IMPORT, garage
from tests.web.live import check_picture, check_rows, compiled, pictures

pytestmark = pytest.mark.browser
__all__ = ["garage"]  # a fixture

TEXTS = Path(__file__).with_name("corners.nsgs").read_text().split("--- ")[1:]
SCENES = dict(text.split("\n", 1) for text in TEXTS)


@pytest.mark.parametrize("name", SCENES)
def test_corners(name: str, viewer_page: Any) -> None:
    source = SourceFile(name, f"nsg 1;\nparam n = 3 in -5..9;\n{SCENES[name]}")
    first = compiled(source)
    form = first.form()
    cases = [(n, frame) for n in (3, 1, 0.5, 0, 7, -2) for frame in (0, first.evaluation.frames - 1)]
    shown = pictures(viewer_page, [(form, [{"params": {"n": n}, "frame": frame} for n, frame in cases])])[0]
    for (n, frame), picture in zip(cases, shown, strict=True):
        try:
            expected = compiled(source, params={"n": n}, frame=frame, model=first.manifest.name)
        except SceneError:
            assert isinstance(picture, str), n
            continue
        assert isinstance(picture, dict), (picture, n)
        check_picture(picture, expected, form)
    assert sum(isinstance(picture, dict) for picture in shown) >= 2


ELEMENTS = [
    "zoo.car() { rotate(30deg, axis = X); } zoo.ring(); sphere { translate(3, 0, 0); }",
    "chain { zoo.ball; smooth zoo.ring { twist(0.3); } subtract zoo.ring() { scale(0.4); } }",
    """let m = material volumetric zoo.hide { hue(0.2turn); color(#d33); color(#3d3); }; zoo.ball { m; }
       sphere { m { grayscale(0.5); grayscale(0.2); } translate(3, 0, 0); } zoo.ring();""",
    "zoo.logo() { scale(0.3); } square { translate(1, 0); }",
    'import "zoo.safetensors" as again; again.ball { material again.hide; } zoo.ring { translate(2, 0, 0); }',
    'import "lib.nsg" as lib; lib.two(0.5) { material flat; } square { scale(lib.k + lib.f(1)); lib.red; }',
    "param n = 0; if (n > 0) { zoo.car(); } else { sphere; }",
]


@pytest.mark.parametrize("text", ELEMENTS)
def test_elements_and_imports(text: str, garage: Path, viewer_page: Any) -> None:
    lib = "param k = 0.3; fn f(x) = k * x; module two(s) { zoo.tile { scale(s); } square { scale(f(s)); } }"
    red = "let red = material flat { color([k, 0, 0]); }; square; background(#000);"
    (garage / "lib.nsg").write_text(f"{IMPORT} {lib} {red}")
    source, path = SourceFile("scene.nsg", IMPORT + text), garage / "scene.nsg"
    first = compiled(source, path)
    form = first.form()
    changes = {"lib.k": 0.7} if "lib" in text else {"n": 1} if "param" in text else {}
    before, after = pictures(viewer_page, [(form, [{}, {"params": changes}])])[0]
    check_rows(before["rows"], first.program)
    check_picture(before, first, form)
    check_picture(after, compiled(source, path, params=changes), form)
