"""Pages as text, inert whatever a scene's author wrote; and in a browser, where they ask for nothing."""

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

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.drawing.metrics import psnr
from scenelang.language.evaluation import Source
from scenelang.web.arrays import MODULES, script, web
from scenelang.web.export import alternative, colour_name, export, page, plain, still, view_of, viewed
from scenelang.web.volume import Detail
from tests.browser import watched
from tests.test_docs import build_site

ROOT = Path(__file__).parents[2]
EXAMPLES = {path.stem: path for path in sorted(ROOT.glob("examples/*.nsg"))}
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


def test_the_script_is_one_and_makes_no_code_and_no_markup_of_texts() -> None:
    assert not re.search(r"^\s*(import|export)\b|</script|<!--", script(), re.MULTILINE)
    assert not re.search(
        r"\beval\(|new Function|(inner|outer)HTML|insertAdjacentHTML|document\.write", script()
    )
    names = re.findall(r"^(?:async )?(?:function\*?|class|const|let) (\w+)", script(), re.MULTILINE)
    assert {name for name, count in Counter(names).items() if count > 1} == set()
    for at, name in enumerate(MODULES):
        needed = re.findall(r'from "\./(\w+)\.js"', web(f"{name}.js"))
        assert not set(needed) & set(MODULES[at:]), name


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


# ---------------------------------------------------------------- in a browser

EVIL = "\u202e\u2066 </script><script>alert(1)</script><!-- <img src=x onerror=alert(1)> ${a} [[code]]"
HOSTILE = f"""// {EVIL}
param said = "{EVIL}";
param {"k" * 300} = 1 in 0..2;  // {EVIL}
star {{ scale({"k" * 300} * (said == "" ? 0.2 : 0.5)); }}
"""


def loaded(page: Any, path: Path) -> Any:
    """Open a page's file and wait until it has drawn; the addresses that it asked for."""
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url.partition(":")[0]))
    page.goto(path.as_uri())
    page.wait_for_function("() => canvas.classList.contains('drawn') || !note.hidden")
    return asked


def test_bytes_of_objects_and_of_light_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """As docs/viewer.md says, where nothing is alike: random objects, and the noise of few rays."""
    monkeypatch.setattr("scenelang.web.export.FULL", Detail(rays=4, more=0))
    place = "translate(rand(i + 1), rand(i + 2), rand(i + 3));"
    look = "color([rand(i + 4), rand(i + 5), rand(i + 6)]);"
    many = f"sphere {{ scale(0.01 + 0.01 * rand(i)); {place} material diffuse {{ {look} }} }}"
    mist = f"sphere {{ scale(0.2); {place} material volumetric; }}"
    for text, most in (
        ("sphere;", 150_000),
        (f"for (i in 0..<1000) {{ {many} }}", 150_000 + 120_000),
        (f"sky(); for (i in 0..<20) {{ {mist} }}", 150_000 + 600_000),
    ):
        assert most / 3 < len(page(view_of(nsg.compile(nsg.loads(text))))) < most


@pytest.mark.browser
def test_pages_of_examples_draw_and_ask_for_nothing(chromium: Any, tmp_path: Path) -> None:
    """And say nothing to the console."""
    out = tmp_path / "page.html"
    drawn = [path for path in EXAMPLES.values() if "\nsky(" not in path.read_text("utf-8")]  # quick ones
    for path in drawn[::5]:
        export(path, out)
        if not nsg.load(path).elements:
            assert out.stat().st_size < 150_000, path
        with watched(chromium, viewport={"width": 260, "height": 320}, reduced_motion="reduce") as page:
            asked = loaded(page, out)
            assert page.locator("#note").is_hidden(), (path, page.locator("#note").text_content())
            assert page.locator("#still").is_hidden(), path
            for slider in page.locator("input[type=range]").all():
                slider.focus()
                slider.press("ArrowRight")
            page.wait_for_timeout(50)
            assert page.locator(".why:not(:empty)").all_text_contents() == [], path
            assert set(asked) <= {"file", "data", "blob"}, path
            assert asked.count("file") == 1
            assert page.evaluate("document.documentElement.scrollWidth") <= 260, path


@pytest.mark.browser
def test_light_of_the_moment_of_export_is_said(chromium: Any, tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text(
        "param k = 0.4 in 0..1; sky(k); light([1, 3, 2], 9, #fff, k); sphere { scale(k); }"
    )
    nsg.export(tmp_path / "a.nsg", tmp_path / "a.html", size=(64, 48))
    assert (tmp_path / "a.html").stat().st_size < 800_000
    with watched(chromium, viewport={"width": 200, "height": 200}) as page:
        loaded(page, tmp_path / "a.html")
        page.locator("#note").wait_for(state="hidden")
        assert page.get_by_text("does not follow what moves").is_visible()
        page.locator("input[type=range]").first.press("ArrowRight")
        page.wait_for_timeout(50)
        assert page.locator(".why:not(:empty)").all_text_contents() == []


@pytest.mark.browser
def test_what_strangers_wrote_is_inert(chromium: Any, tmp_path: Path) -> None:
    scene = tmp_path / f"{EVIL.replace('/', '')[:40]}.nsg"
    scene.write_text(HOSTILE, "utf-8")
    export(scene, tmp_path / "a.html", title=EVIL * 20)
    with watched(chromium, viewport={"width": 360, "height": 640}) as page:
        asked = loaded(page, tmp_path / "a.html")
        assert asked.count("file") == 1
        text = page.locator("body").inner_text()
        assert "\u202e" not in text + page.title()
        assert "⟨U+202E⟩" in text
        assert page.locator("img[src=x]").count() == 0
        assert page.locator("summary").first.text_content() == f"Source {plain(scene.name)}"
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        page.locator("summary").first.click()
        page.get_by_text("Copy", exact=True).click()
        page.get_by_text("Copied").wait_for()


@pytest.mark.browser
def test_a_still_picture_where_it_cannot_draw(chromium: Any, tmp_path: Path) -> None:
    export(nsg.loads("star;"), tmp_path / "a.html")
    for broken, why in (
        ("HTMLCanvasElement.prototype.getContext = () => null", "no WebGL2"),
        ("delete globalThis.DecompressionStream", "cannot unpack"),
        ("WebGL2RenderingContext.prototype.getProgramParameter = () => false", "the shader does not compile"),
    ):
        with watched(chromium) as page:
            page.add_init_script(broken)
            loaded(page, tmp_path / "a.html")
            assert why in page.locator("#note").text_content()
            assert page.locator("#still").is_visible()
            assert page.evaluate("still.naturalWidth") == 960
    with watched(chromium, java_script_enabled=False) as page:
        page.goto((tmp_path / "a.html").as_uri())
        assert page.locator("#still").is_visible()
        assert "needs JavaScript" in page.locator("noscript").inner_text()


@pytest.mark.browser
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


@pytest.mark.browser
def test_motion_begins_unless_it_is_unwanted(chromium: Any, tmp_path: Path) -> None:
    export(EXAMPLES["spinner"], tmp_path / "a.html")
    for wish, word in (("no-preference", "Pause"), ("reduce", "Play")):
        with watched(chromium, viewport={"width": 200, "height": 200}, reduced_motion=wish) as page:
            loaded(page, tmp_path / "a.html")
            assert page.get_by_text(word).count() == 1


OPEN = """async (message) => {
  document.body.replaceChildren(element("canvas", { id: "canvas", width: 128, height: 128 }));
  globalThis.refused = [];
  const onerror = ({ message }) => refused.push(message);
  globalThis.viewer = new Viewer(canvas, await readView(message), { onerror });
}"""
SNAPSHOT = """async () => {
  viewer.orbit(0.7, 0.3), viewer.zoom(0.9), viewer.pan(0.05, -0.08);
  const picture = new FileReader();
  picture.readAsDataURL(await viewer.snapshot());
  await new Promise((done) => (picture.onload = done));
  return picture.result.split(",")[1];
}"""


@pytest.mark.browser
def test_the_line_of_a_moved_camera_gives_its_picture(viewer_page: Any) -> None:
    """What the page shows then is what `render` draws of the text with that line."""
    path, size = EXAMPLES["die"], (128, 128)
    view, _ = viewed(Source(path, size=size), path.stem)
    viewer_page.evaluate(OPEN, json.loads(view.message()))
    data = viewer_page.evaluate(SNAPSHOT)
    line = viewer_page.evaluate("viewer.cameraLine()")
    assert viewer_page.evaluate("refused") == []
    text, times = re.subn(r"^camera\(.*$", line, path.read_text("utf-8"), flags=re.MULTILINE)
    assert times == 1
    expected = np.asarray(nsg.render(nsg.loads(text, size=size, root=path.parent)))
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        shown = np.asarray(image.convert("RGB"), np.float32) / 255
    assert psnr(shown, expected[..., :3]) >= 40
    assert psnr(shown, np.asarray(nsg.render(nsg.load(path, size=size)))[..., :3]) < 30


def seen(data: bytes) -> np.ndarray:
    """A picture in few pixels (24, 24, 3), in [0, 1]."""
    small = Image.open(io.BytesIO(data)).convert("RGB").resize((24, 24), Image.Resampling.BOX)
    return np.asarray(small, np.float64) / 255


@pytest.mark.browser
def test_a_click_brings_a_picture_to_life(chromium: Any, tmp_path: Path) -> None:
    build_site(tmp_path)
    with watched(chromium, viewport={"width": 1200, "height": 900}) as page:
        page.goto((tmp_path / "examples.html").as_uri())
        link = page.locator('a.live[href$="viewers/chain.html"]')
        still = seen((ROOT / "docs/pictures/chain.png").read_bytes())
        link.click()
        frame = page.locator("iframe.live")
        assert frame.get_attribute("sandbox") == "allow-scripts"
        inside = page.frame_locator("iframe.live")
        for _ in range(100):
            live = seen(inside.locator("canvas").screenshot())
            if np.square(live - still).mean() < 1e-3:
                break
            page.wait_for_timeout(100)
        np.testing.assert_allclose(np.square(live - still).mean(), 0, atol=1e-3)
        inside.locator("input[type=range]").fill("0")
        page.wait_for_timeout(1000)
        moved = seen(inside.locator("canvas").screenshot())
        assert np.square(moved - still).mean() > 1e-3
