"""The page of `scenelang play` in Chromium, with a real server: what is typed is seen, kept and saved."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from tests.browser import watched
from tests.play.client import Server
from tests.play.page import Page, opened

pytestmark = pytest.mark.browser
SCENE = """nsg 1;
canvas(600, 600);
param r = 0.5 in 0..1;
background(#336699);
square { scale(r); material flat { color(#ff0000); } }
"""
SOLID = "nsg 1;\ncanvas(48, 48);\nsphere { material diffuse { color(#cc3333); } }\n"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "scenes").mkdir()
    path = tmp_path / "scenes/a.nsg"
    path.write_text(SCENE, "utf-8")
    return path


@pytest.fixture
def server(scene: Path, tmp_path: Path) -> Iterator[Server]:
    with Server(scene, tmp_path / "state") as server:
        yield server


@pytest.fixture
def page(chromium: Any, server: Server) -> Iterator[Page]:
    with opened(chromium, server, viewport={"width": 1280, "height": 800}) as page:
        yield page


def test_what_is_typed_is_drawn_and_saved(page: Page, scene: Path) -> None:
    before = page.picture()
    page.click_text("square")
    page.page.keyboard.type("\nstar {scale(0.3);}")
    page.other_picture(before)
    assert scene.read_text("utf-8") == SCENE
    page.page.locator("#unsaved").wait_for()
    page.knows()
    page.page.keyboard.press("Control+s")
    page.page.locator("#unsaved").wait_for(state="hidden")
    assert "\nstar { scale(0.3); }\n" in scene.read_text("utf-8"), "saved, and laid out"


def test_a_mistake_is_shown_while_the_last_picture_stays(page: Page) -> None:
    before = page.picture()
    page.knows()
    page.click_text("background")
    page.page.keyboard.insert_text("\nsquar;")
    page.page.locator(".cm-lintRange-error", has_text="squar").wait_for()
    page.page.locator("#note", has_text="The last picture: the text has mistakes").wait_for()
    assert page.picture() == before
    page.page.locator(".cm-lintRange-error", has_text="squar").hover()
    page.page.locator(".mistake", has_text="E0204").wait_for()
    page.page.get_by_role("button", name="`square`").click()
    page.has("square;")
    page.other_picture(before)
    page.page.locator("#problems", has_text="No mistakes").wait_for()


def test_completion_hover_and_arguments_know_the_language(page: Page) -> None:
    page.knows()
    page.click_text("background")
    page.page.keyboard.type("\npent")
    page.page.locator(".cm-tooltip-autocomplete [aria-selected]", has_text="pentagon").wait_for()
    page.page.wait_for_timeout(100)  # a list that has just opened takes no key
    page.page.keyboard.press("Enter")
    page.has("pentagon {")
    page.page.keyboard.type("translate(0.1, ")
    page.page.locator(".call strong", has_text=re.compile("^dy$|^y$")).wait_for()
    page.page.keyboard.press("Escape")
    page.page.locator(".cm-line", has_text="param r").get_by_text("r", exact=True).hover()
    page.page.locator(".cm-tooltip-hover .markdown", has_text="in 0..1").wait_for()


def test_a_slider_is_drawn_by_the_shader_and_then_by_the_network(page: Page) -> None:
    before = page.picture()
    page.page.locator("#controls input[type=range]").fill("0.9")
    page.until("document.getElementById('told').textContent.startsWith('shader')")
    assert page.other_picture(before) != before
    assert "0.5" in page.text(), "the text stays"


def test_without_webgl_the_server_draws_all(chromium: Any, server: Server) -> None:
    with opened(chromium, server, "HTMLCanvasElement.prototype.getContext = () => null;") as page:
        before = page.picture()
        page.page.locator("#note", has_text="WebGL2").wait_for()
        page.page.locator("#controls input[type=range]").fill("0.9")
        page.other_picture(before)


def test_the_camera_is_written_into_the_text(page: Page, scene: Path) -> None:
    page.picture()
    scene.write_text(SOLID, "utf-8")
    page.has("sphere")
    page.page.get_by_role("button", name="Write camera").wait_for()
    for _ in range(3):
        page.page.locator("#stage").press("ArrowRight")
    before = page.page.locator("#still").get_attribute("src")
    page.page.get_by_role("button", name="Write camera").click()
    page.has("camera(eye = [")
    page.other_picture(str(before))
    lines = page.text().splitlines()
    assert lines[1] == "canvas(48, 48);"
    assert re.fullmatch(r"camera\(eye = \[.+\], target = \[0, 0, 0\], fov = 36.87deg\);", lines[2])
    page.page.locator(".cm-content").press("Control+z")
    page.until("!document.querySelector('.cm-content').textContent.includes('camera')")


def test_files_on_the_disk_and_texts_are_in_step(page: Page, scene: Path) -> None:
    before = page.picture()
    scene.write_text(SCENE.replace("#ff0000", "#00ff00"), "utf-8")
    page.has("#00ff00")
    before = page.other_picture(before)
    page.click_text("background")
    page.page.keyboard.type("  // mine")
    scene.write_text(SCENE.replace("#ff0000", "#0000ff"), "utf-8")
    bar = page.page.locator(".asks", has_text="changed on the disk")
    bar.wait_for()
    assert "// mine" in page.text()
    bar.get_by_role("button", name="Keep mine").click()
    page.page.keyboard.press("Control+s")
    page.page.locator("#unsaved").wait_for(state="hidden")
    assert "// mine" in scene.read_text("utf-8")
    assert "#00ff00" in scene.read_text("utf-8")


def test_what_was_not_saved_is_back_after_a_crash(chromium: Any, scene: Path, tmp_path: Path) -> None:
    for crash in range(2):
        with Server(scene, tmp_path / "state") as server, opened(chromium, server) as page:
            page.picture()
            if crash:
                page.has("// mine")
                page.page.locator(".asks", has_text="not saved").wait_for()
                assert scene.read_text("utf-8") == SCENE
                page.page.get_by_role("button", name="Take the file").click()
                page.until("!document.querySelector('.cm-content').textContent.includes('mine')")
            else:
                page.click_text("background")
                page.page.keyboard.type("  // mine")
                page.until("Object.values(localStorage).some((kept) => kept.includes('// mine'))")
                page.page.wait_for_timeout(1500)  # the server keeps it within half a second
                server.process.kill()
                page.page.locator("#line", has_text="does not answer").wait_for()


def test_a_definition_in_another_file_is_gone_to(page: Page, scene: Path) -> None:
    library = "nsg 1;\n\nmodule dot(r) {\n  square { scale(r); }\n}\n"
    scene.with_name("lib (1).nsg").write_text(library, "utf-8")
    page.picture()
    page.knows()
    page.click_text("square")
    page.page.keyboard.insert_text('\nimport "lib (1).nsg" as lib;\nlib.dot(0.1);')
    page.page.locator(".cm-line", has_text="lib.dot").get_by_text("dot", exact=False).last.click()
    page.page.keyboard.press("F12")
    page.page.locator("#files option:checked", has_text="lib (1).nsg").wait_for(state="attached")
    page.page.locator(".cm-activeLine", has_text="module dot(r)").wait_for()


def test_a_new_scene_begins_with_an_example(page: Page, scene: Path) -> None:
    page.picture()
    page.page.get_by_role("button", name="New…").click()
    page.page.get_by_label("Begin with").select_option("hello.nsg")
    page.page.get_by_label("Name").fill("first")
    page.page.get_by_role("button", name="OK").click()
    page.page.locator("#files option:checked", has_text="first.nsg").wait_for(state="attached")
    page.has("The shortest scene")
    page.page.locator("#unsaved").wait_for(state="hidden")
    made = scene.with_name("first.nsg").read_text("utf-8")
    assert made == (Path(__file__).parents[2] / "examples/hello.nsg").read_text("utf-8")


def test_a_stranger_s_text_stays_text(page: Page, scene: Path) -> None:
    evil = "</script><img src=x onerror=document.title=1> \u202e"
    page.picture()
    page.knows()
    lines = [
        "nsg 1;",
        f"// {evil}",
        f'param name = "{evil}";',
        'square { scale(name == "a" ? 0.4 : 0.5); }',
        "",
    ]
    scene.write_text("\n".join(lines), "utf-8")
    page.page.locator(".cm-specialChar").first.wait_for()
    page.page.locator("#controls input[type=text]").wait_for()
    page.page.locator(".cm-line", has_text="param").get_by_text("name").hover()
    page.page.locator(".cm-tooltip-hover .markdown", has_text="</script><img src=x").wait_for()
    assert page.page.locator("img:not(.cm-widgetBuffer)").count() == 1, "the picture alone"
    assert page.page.title() == "a.nsg – scenelang"


def test_the_picture_is_downloaded(page: Page) -> None:
    page.picture()
    page.page.get_by_role("button", name="Download…").click()
    page.page.get_by_label("Width of pictures").fill("40")
    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="PNG").click()
    assert download.value.suggested_filename == "a.png"
    data = Path(download.value.path()).read_bytes()
    assert data[16:24] == (40).to_bytes(4, "big") * 2


STATEMENTS = Path(__file__).parents[2] / "scenelang/web/editor/statements.js"
LINE = "camera(eye = [9, 8, 7], target = [1, 0.5, 0], fov = 20deg);"
TEXTS = (
    "",
    "sphere;",
    "/* camera(; */ nsg 1; // camera(eye = [0, 0, 1]);\n// at the end\nsphere;\n",
    'nsg 1;\nparam a = "camera();";\nsphere;\n',
    "nsg 1;\ncamera(\n  eye = [0, 0, 5], /* here ) */\n  fov = 30deg\n);\nsphere;\n",
    "nsg 1; camera(eye = [0, 0, 5]); sphere;",
    "nsg 1;\n// 😀 \u202e\nbackground(#fff);\nsphere;\n",
)


def test_the_camera_of_a_text_is_written(chromium: Any) -> None:
    """A camera's line goes where it counts, and nothing else moves."""
    script = """([text, line]) => {
      const { from, to, insert } = settled(text, "camera", line);
      return text.slice(0, from) + insert + text.slice(to ?? from);
    }"""
    with watched(chromium) as page:
        page.add_script_tag(content=STATEMENTS.read_text("utf-8").replace("\nexport ", "\n"))
        for text in TEXTS:
            after = page.evaluate(script, [text, LINE])
            assert nsg.loads(f"{after}sphere;").camera.eye == pytest.approx((9, 8, 7)), text
            assert page.evaluate(script, [after, LINE]) == after, "writing it again changes nothing"
            for kept in re.findall(r"//.*|sphere.*|param.*|background.*", text):
                assert kept in after, text
