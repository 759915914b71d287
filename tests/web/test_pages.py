"""Pages of the examples in a browser: they draw, ask for nothing and say nothing to the console."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from scenelang.web.export import export, plain
from tests.browser import watched
from tests.web.conftest import ask

EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").glob("*.nsg"))
ODD = "\u202e\u2066 </script><script>alert(1)</script><!-- <img src=x onerror=alert(1)> ${a} [[code]]"
HOSTILE = f"""// {ODD}
param said = "{ODD}";
param {"k" * 300} = 1 in 0..2;  // {ODD}
star {{ scale({"k" * 300} * (said == "" ? 0.2 : 0.5)); }}
"""

pytestmark = pytest.mark.browser


def loaded(page: Any, path: Path) -> Any:
    """Open a page's file and wait until it has drawn; the addresses that it asked for."""
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url.partition(":")[0]))
    page.goto(path.as_uri())
    page.wait_for_function("() => canvas.classList.contains('drawn') || !note.hidden")
    return asked


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples(chromium: Any, tmp_path: Path, path: Path) -> None:
    out = tmp_path / "page.html"
    export(path, out)
    if not nsg.load(path).elements:
        assert out.stat().st_size < 150_000
    with watched(chromium, viewport={"width": 260, "height": 320}, reduced_motion="reduce") as page:
        asked = loaded(page, out)
        assert page.locator("#note").is_hidden(), page.locator("#note").text_content()
        assert page.locator("#still").is_hidden()
        for slider in page.locator("input[type=range]").all():
            slider.focus()
            slider.press("ArrowRight")
        page.wait_for_timeout(50)
        assert page.locator(".why:not(:empty)").all_text_contents() == []
        assert set(asked) <= {"file", "data", "blob"}
        assert asked.count("file") == 1
        assert ask(page, "document.documentElement.scrollWidth") <= 260


def test_what_strangers_wrote_is_inert(chromium: Any, tmp_path: Path) -> None:
    scene = tmp_path / f"{ODD.replace('/', '')[:40]}.nsg"
    scene.write_text(HOSTILE, "utf-8")
    export(scene, tmp_path / "a.html", title=ODD * 20)
    with watched(chromium, viewport={"width": 360, "height": 640}) as page:
        asked = loaded(page, tmp_path / "a.html")
        assert asked.count("file") == 1
        text = page.locator("body").inner_text()
        assert "\u202e" not in text + page.title()
        assert "⟨U+202E⟩" in text
        assert page.locator("img[src=x]").count() == 0
        assert page.locator("summary").first.text_content() == f"Source {plain(scene.name)}"
        assert ask(page, "document.documentElement.scrollWidth") <= 360
        page.locator("summary").first.click()
        page.get_by_text("Copy", exact=True).click()
        page.get_by_text("Copied").wait_for()


@pytest.mark.parametrize(
    ("broken", "why"),
    [
        ("HTMLCanvasElement.prototype.getContext = () => null", "no WebGL2"),
        ("delete globalThis.DecompressionStream", "cannot unpack"),
        ("WebGL2RenderingContext.prototype.getProgramParameter = () => false", "the shader does not compile"),
    ],
)
def test_a_still_picture_where_it_cannot_draw(chromium: Any, tmp_path: Path, broken: str, why: str) -> None:
    export(nsg.loads("star;"), tmp_path / "a.html")
    with watched(chromium) as page:
        page.add_init_script(broken)
        loaded(page, tmp_path / "a.html")
        assert why in page.locator("#note").text_content()
        assert page.locator("#still").is_visible()
        assert ask(page, "still.naturalWidth") == 960


def test_a_still_picture_without_scripts(chromium: Any, tmp_path: Path) -> None:
    export(nsg.loads("star;"), tmp_path / "a.html")
    with watched(chromium, java_script_enabled=False) as page:
        page.goto((tmp_path / "a.html").as_uri())
        assert page.locator("#still").is_visible()
        assert "needs JavaScript" in page.locator("noscript").inner_text()


def test_a_frame_in_a_notebook(chromium: Any, tmp_path: Path) -> None:
    shown = nsg.loads("canvas(300, 200); sphere;")._repr_mimebundle_()
    (tmp_path / "notebook.html").write_text(f"<!doctype html><title>a</title>{shown['text/html']}", "utf-8")
    with watched(chromium) as page:
        page.goto((tmp_path / "notebook.html").as_uri())
        frame = page.frame_locator("iframe")
        frame.locator("canvas.drawn").wait_for()
        assert frame.locator("h1").is_hidden()
        frame.get_by_text("Copy camera line").click()
        frame.get_by_text("Copied").wait_for()
        sizes = page.frames[1].evaluate("[document.documentElement.scrollHeight, innerHeight]")
        assert sizes[0] <= sizes[1], "nothing has to be scrolled to"


def test_motion_begins_unless_it_is_unwanted(chromium: Any, tmp_path: Path) -> None:
    path = next(path for path in EXAMPLES if path.stem == "spinner")
    export(path, tmp_path / "a.html")
    for wish, word in (("no-preference", "Pause"), ("reduce", "Play")):
        with watched(chromium, viewport={"width": 200, "height": 200}, reduced_motion=wish) as page:
            loaded(page, tmp_path / "a.html")
            assert page.get_by_text(word).count() == 1
