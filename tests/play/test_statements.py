"""What the page changes in a text: a camera's line goes where it counts, and nothing else moves."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from tests.browser import watched

pytestmark = pytest.mark.browser
ROOT = Path(__file__).parents[2]
MODULE = (ROOT / "scenelang/web/editor/statements.js").read_text("utf-8")
SCRIPT = re.sub("^export ", "", MODULE, flags=re.MULTILINE)
LINE = "camera(eye = [9, 8, 7], target = [1, 0.5, 0], fov = 20deg);"
TEXTS = {
    "nothing": "",
    "an object": "sphere;",
    "comments": "/* camera(; */ nsg 1; // camera(eye = [0, 0, 1]);\n// at the end\nsphere;\n",
    "in a string": 'nsg 1;\nparam a = "camera();";\nsphere;\n',
    "many lines": "nsg 1;\ncamera(\n  eye = [0, 0, 5], /* here ) */\n  fov = 30deg\n);\nsphere;\n",
    "in one line": "nsg 1; camera(eye = [0, 0, 5]); sphere;",
    "other signs": "nsg 1;\n// 😀 \u202e\nbackground(#fff);\nsphere;\n",
}


@pytest.fixture(scope="module")
def settle(chromium: Any) -> Any:
    with watched(chromium) as page:
        page.add_script_tag(content=SCRIPT)
        script = """([text, line]) => {
          const { from, to, insert } = settled(text, "camera", line);
          return text.slice(0, from) + insert + text.slice(to ?? from);
        }"""
        yield lambda text: page.evaluate(script, [text, LINE])


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_the_camera_of_a_text_is_written(settle: Any, text: str) -> None:
    after = settle(text)
    scene = nsg.loads(f"{after}sphere;")
    assert scene.camera.eye == pytest.approx((9, 8, 7))
    assert settle(after) == after, "writing it again changes nothing"
    for kept in re.findall(r"//.*|sphere.*|param.*|background.*", text):
        assert kept in after
