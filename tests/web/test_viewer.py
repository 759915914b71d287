"""The viewer and its controls in a browser: time, params, cameras, sizes, lost contexts.

Its drawers paint one colour here that tells what they were given; the shaders have tests of their own.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.spaces import Camera
from scenelang.web.export import view_of

pytestmark = pytest.mark.browser

SETUP = """
const [message, more] = JSON.parse(TEXT);
globalThis.told = [];
globalThis.refused = [];
globalThis.scales = [];
globalThis.pieces = [];
globalThis.made = 0;
planeDrawer = solidDrawer = (gl, view) => {
  made += 1;
  const inPieces = view.dimension === 3 && {
    *pieces(program, size) {
      for (let piece = 0; piece < 3; piece += 1) {
        pieces.push(piece);
        yield;
      }
      this.draw(program, size);
    },
  };
  return {
    ...inPieces,
    draw(program, { width, height, scale }) {
      if (globalThis.broken === scale) throw new Error("no shader");
      gl.viewport(0, 0, width, height);
      gl.clearColor(program.shade ?? 0, scale, program.stage ? 0.5 : 0, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      scales.push(scale);
      globalThis.drawn = { program, width, height, scale };
      for (const end = performance.now() + (globalThis.slow ?? 0); performance.now() < end;);
    },
    relight(part) {
      globalThis.light = part;
    },
    dispose() {},
  };
};
evaluateForm = (form, { params, frame }) => {
  if (params.k > 2) throw new Error("`k` is too much");
  return { rows: [], stage: null, background: null, shade: params.k / 2, frame };
};
const canvas = document.createElement("canvas");
canvas.id = "canvas";
canvas.width = 64;
canvas.height = 48;
document.body.replaceChildren(canvas);
return readView({ ...message, ...more }).then((view) => {
  globalThis.view = view;
  globalThis.viewer = new Viewer(canvas, view, {
    onchange: ({ kind }) => told.push(kind), onerror: (error) => refused.push(error),
  });
  viewer.draw();
});
"""


@pytest.fixture
def shown(viewer_page: Any) -> Callable[..., Any]:
    """Opens a viewer of a scene's text in the page, whose data may be changed."""

    def opened(text: str = "canvas(64, 48); star;", **more: Any) -> Any:
        view = view_of(nsg.compile(nsg.loads(text)))
        data = json.dumps(json.dumps([json.loads(view.message()), more]))
        viewer_page.evaluate("(code) => new Function(code)()", SETUP.replace("TEXT", data))
        return viewer_page

    return opened


def ask(page: Any, expression: str) -> Any:
    return page.evaluate(f"() => ({expression})")


FORM = {"form": {"any": 1}, "params": [{"name": "k", "kind": "number", "value": 1, "low": 0, "high": 4}]}
MOVING = {"animation": {"seconds": 1, "fps": 20, "frames": 20, "loop": True}}
SOLID = "camera(eye = [1, 2, 4], target = [0, 0.5, 0], fov = 40deg); sphere;"


def settled(page: Any) -> None:
    """Wait until the viewer has drawn in full and asks for nothing more."""
    page.wait_for_function("() => drawn.scale === 1")


def test_params_and_what_cannot_be(shown: Any) -> None:
    page = shown(**FORM)
    assert ask(page, "drawn.program.shade") == 0.5
    ask(page, "viewer.set('k', 2), viewer.draw()")
    assert ask(page, "drawn.program.shade") == 1
    ask(page, "viewer.set('k', 3), viewer.draw()")
    assert ask(page, "drawn.program.shade") == 1, "the last good picture stays"
    assert ask(page, "refused") == [{"kind": "param", "name": "k", "message": "`k` is too much"}]
    ask(page, "viewer.reset(), viewer.draw()")
    assert ask(page, "drawn.program.shade") == 0.5
    assert ask(page, "refused[1].message") is None


def test_time_passes_at_its_own_speed(viewer_page: Any, shown: Any) -> None:
    viewer_page.clock.install(time=0)
    page = shown(**FORM, **MOVING)
    page.clock.pause_at(3600)
    ask(page, "(viewer.seek(15), viewer.play())")
    seen = []
    for _ in range(30):
        page.clock.run_for(100)
        seen.append(ask(page, "viewer.frame"))
    for step, frame in enumerate(seen, 1):  # 20 frames a second, seen at the last of the screen's 60
        assert (15 + 2 * step - frame) % 20 in (0, 1)
    ask(page, "viewer.pause()")
    page.clock.run_for(1000)
    assert ask(page, "[viewer.frame, viewer.playing]") == [seen[-1], False]


def test_an_animation_without_loop_ends(shown: Any) -> None:
    page = shown(**FORM, animation={"seconds": 0.2, "fps": 20, "frames": 4, "loop": False})
    ask(page, "viewer.play()")
    page.wait_for_function("() => !viewer.playing")
    assert ask(page, "viewer.frame") == 3
    assert ask(page, "(viewer.play(), viewer.frame)") == 0
    ask(page, "viewer.seek(99)")
    assert ask(page, "viewer.frame") == 3


def test_nothing_is_drawn_at_rest(shown: Any) -> None:
    page = shown(**FORM)
    settled(page)
    page.wait_for_timeout(600)
    count = ask(page, "told.length")
    page.wait_for_timeout(600)
    assert ask(page, "told.length") == count
    ask(page, "viewer.set('k', 0.5)")
    page.wait_for_function("() => drawn.program.shade === 0.25")


def test_it_draws_coarser_while_it_cannot_keep_up(shown: Any) -> None:
    page = shown(**FORM, **MOVING)
    settled(page)
    ask(page, "void (globalThis.slow = 70, viewer.play())")
    page.wait_for_function("() => drawn.scale < 1")
    wide, high, scale = ask(page, "[drawn.width / 64, drawn.height / 48, drawn.scale]")
    assert [wide, high] == pytest.approx([scale, scale], abs=0.02)
    ask(page, "void (globalThis.slow = 0)")
    page.wait_for_function("() => drawn.scale === 1 && viewer.playing")
    ask(page, "void (globalThis.slow = 70)")
    page.wait_for_function("() => drawn.scale < 1")
    ask(page, "viewer.pause()")
    settled(page)


def test_solids_begin_coarse_and_end_full(shown: Any) -> None:
    page = shown(SOLID)
    ask(page, "viewer.orbit(0.1, 0)")
    page.wait_for_function("() => scales.includes(0.25) && drawn.scale === 1 && canvas.width === 64")
    assert ask(page, "pieces.slice(-3)") == [0, 1, 2]


@pytest.mark.parametrize("scale", [0.25, 1])
def test_what_cannot_be_drawn_is_told(shown: Any, scale: float) -> None:
    page = shown(SOLID)
    ask(page, f"void (globalThis.broken = {scale}, viewer.orbit(0.1, 0))")
    page.wait_for_function("() => refused.length > 0")
    assert ask(page, "refused[0]") == {"kind": "shader", "message": "no shader"}


def test_a_lost_context_comes_back(shown: Any) -> None:
    page = shown(**FORM)
    settled(page)
    before = ask(page, "canvas.toDataURL(viewer.draw())")
    lost = "canvas.getContext('webgl2').getExtension('WEBGL_lose_context')"
    ask(page, f"void (globalThis.extension = {lost}, extension.loseContext())")
    page.wait_for_function("() => refused.length === 1")
    assert ask(page, "refused[0].kind") == "lost"
    ask(page, "viewer.draw()")
    ask(page, "void extension.restoreContext()")
    page.wait_for_function("() => refused.length === 2")
    assert ask(page, "refused[1]") == {"kind": "lost", "message": None}
    assert ask(page, "canvas.toDataURL(viewer.draw())") == before
    assert ask(page, "made") == 2


def test_another_view_keeps_what_was_moved(shown: Any) -> None:
    page = shown(**FORM, **MOVING)
    ask(page, "viewer.set('k', 2), viewer.seek(15)")
    ask(page, "void (viewer.view = { ...view, network: { ...view.network } })")
    assert ask(page, "[made, viewer.params.k, viewer.frame]") == [1, 2, 15], "the same shader is used again"
    switch = "[{ name: 'k', kind: 'bool', value: true }]"
    ask(page, f"void (viewer.view = {{ ...view, params: {switch}, animation: null }})")
    assert ask(page, "[made, viewer.params.k, viewer.frame]") == [1, True, 0]
    ask(page, "void (viewer.view = { ...view, shader: { other: 1 } })")
    assert ask(page, "[made, viewer.params.k]") == [2, 1]
    for at, (light, made) in enumerate((({"top": 1}, 3), ({"top": 2}, 3), (None, 4))):
        ask(page, f"void (viewer.view = {{ ...viewer.view, around: {json.dumps(light)} }})")
        assert ask(page, "[made, globalThis.light?.top]") == [made, None if at == 0 else 2]


def test_the_line_of_a_camera_keeps_its_exposure(shown: Any) -> None:
    page = shown(SOLID.replace("40deg", "40deg, exposure = 2.5"))
    ask(page, "viewer.pan(0.5, 0)")
    assert nsg.loads(f"{ask(page, 'viewer.cameraLine()')} sphere;").camera.exposure == 2.5  # type: ignore[union-attr]


def test_orbits_zooms_and_pans(shown: Any) -> None:
    page = shown(SOLID)
    assert ask(page, "viewer.cameraLine()") == "camera(eye = [1, 2, 4], target = [0, 0.5, 0], fov = 40deg);"
    home = np.array([1, 1.5, 4])
    for turn, rise in ((0.5, 0.2), (-3, -9), (0.1, 99), (2, -50)):
        ask(page, f"viewer.orbit({turn}, {rise})")
        camera = ask(page, "viewer.camera")
        way = np.subtract(camera["eye"], camera["target"])
        assert np.linalg.norm(way) == pytest.approx(np.linalg.norm(home))
        assert np.hypot(way[0], way[2]) > 0.05, "clear of the poles"
    for _ in range(80):
        ask(page, "viewer.zoom(0.7)")
    camera = ask(page, "viewer.camera")
    assert 0.01 < np.linalg.norm(np.subtract(camera["eye"], camera["target"])) < 0.1
    ask(page, "void (viewer.camera = null)")
    ask(page, "viewer.pan(0.5, 0)")
    camera = ask(page, "viewer.camera")
    right = Camera((1.0, 2.0, 4.0), (0.0, 0.5, 0.0)).axes()[1]
    moved = -np.array(right) * np.linalg.norm(home) * np.tan(np.radians(20))
    np.testing.assert_allclose(camera["target"], np.add([0, 0.5, 0], moved), atol=1e-9)
    np.testing.assert_allclose(camera["eye"], np.add([1, 2, 4], moved), atol=1e-9)
    line = ask(page, "viewer.cameraLine()")
    stated = nsg.loads(f"{line} sphere;").camera
    assert not isinstance(stated, str)
    np.testing.assert_allclose(stated.eye, camera["eye"], atol=6e-5)
    np.testing.assert_allclose(
        ask(page, "drawn.program.stage.camera.eye && viewer.program.stage.camera.eye"), camera["eye"]
    )


# ---------------------------------------------------------------- controls

ODD = "\u202eevil</script><img src=x onerror=alert(1)>"
PARAMS = [
    {"name": "k", "kind": "number", "value": 1, "low": 0, "high": 4, "step": 0.5, "label": ODD},
    {"name": "far", "kind": "number", "value": 1.25, "low": 1, "high": 2, "exclusive": True},
    {"name": "n", "kind": "number", "value": 7},
    {"name": "turn", "kind": "angle", "value": pi / 6, "low": 0, "high": pi / 2, "unit": "deg"},
    {"name": "wait", "kind": "time", "value": 0.25, "low": 0, "high": 2, "unit": "ms"},
    {"name": "on", "kind": "bool", "value": False},
    {"name": "ink", "kind": "color", "value": [1, 0.5, 0]},
    {"name": "look", "kind": "string", "value": "day", "choices": ["day", ODD]},
    {"name": "size", "kind": "number", "value": 2, "choices": [1, 2, 4]},
    {"name": "said", "kind": "string", "value": ODD},
    {"name": "list", "kind": "vector", "value": [1, [0.5, 2]]},
    {"name": "side", "kind": "number", "value": 1},
]
FIXED = [{"name": "side", "reason": ODD}]


@pytest.fixture
def controls(shown: Any) -> Any:
    page = shown(form={"any": 1}, params=PARAMS, fixed=FIXED)
    ask(page, "void (globalThis.controls = paramControls(viewer), document.body.append(controls.box))")
    return page


def put(page: Any, selector: str, value: Any) -> Any:
    """Put a value into a control as a user does; what the viewer has then."""
    box = page.locator(selector)
    box.evaluate(
        """(input, value) => {
          if (input.type === "checkbox") input.click();
          else {
            input.value = value;
            for (const kind of ["input", "change"]) input.dispatchEvent(new Event(kind, { bubbles: true }));
          }
        }""",
        value,
    )
    return ask(page, "viewer.params")


def test_controls_set_params(controls: Any) -> None:
    for selector, value, name, expected in (
        ("#param-k", "2.5", "k", 2.5),
        ("[aria-label=k]", "2.3", "k", 2.5),
        ("[aria-label=k]", "9", "k", 4),
        ("[aria-label=far]", "2", "far", pytest.approx(1.999999)),
        ("#param-n", "-3e5", "n", -300000),
        ("#param-n", "", "n", 7),
        ("#param-turn", "45", "turn", pytest.approx(pi / 4)),
        ("#param-wait", "1500", "wait", 1.5),
        ("#param-on", "", "on", True),
        ("#param-ink", "#3366ff", "ink", [0.2, 0.4, 1]),
        ("#param-look", "1", "look", ODD),
        ("#param-size", "2", "size", 4),
        ("#param-said", "</script>", "said", "</script>"),
        ("#param-list", "[1, [2, 3]]", "list", [1, [2, 3]]),
        ("#param-list", "alert(1)", "list", [1, [0.5, 2]]),
    ):
        ask(controls, "viewer.reset()")
        assert put(controls, selector, value)[name] == expected, (selector, value)


def test_controls_show_params(controls: Any) -> None:
    shown = controls.evaluate("() => Array.from(document.querySelectorAll('.param'), (row) => row.innerText)")
    assert "°" in shown[3]
    assert "ms" in shown[4]
    assert controls.locator("#param-turn").input_value() == "30"
    assert controls.locator("#param-wait").get_attribute("max") == "2000"
    assert controls.locator("#param-ink").input_value() == "#ff8000"
    assert controls.locator("#param-list").input_value() == "[1, [0.5, 2]]"
    assert controls.locator("[role=switch]").count() == 1
    assert controls.locator("#param-side").count() == 0
    put(controls, "#param-k", "2.5")
    assert controls.locator("[aria-label=k]").input_value() == "2.5"
    controls.get_by_text("Reset").click()
    assert ask(controls, "viewer.params.k") == 1
    assert controls.locator("#param-k").input_value() == "1"


def test_reasons_stand_beside_their_control(controls: Any) -> None:
    ask(controls, f"controls.refuse('k', {ODD!r})")
    row = controls.locator(".param", has=controls.locator("#param-k"))
    assert "⟨U+202E⟩evil</script>" in row.locator(".why").text_content()
    ask(controls, "controls.refuse('k', null)")
    assert row.locator(".why").text_content() == ""


def test_names_and_texts_of_strangers_are_texts(controls: Any) -> None:
    assert controls.locator("img, script[src]").count() == 0
    text = controls.locator("body").text_content()
    assert "\u202e" not in text
    assert text.count("⟨U+202E⟩evil</script><img") == 3  # a comment, a choice, a reason
    assert controls.evaluate("(text) => listing(text).textContent", f"a\r\n\tb{ODD}") == (
        "a\n\tb⟨U+202E⟩evil</script><img src=x onerror=alert(1)>"
    )
    assert controls.evaluate("() => plainText('\\ud800 \\u{1f600} é')") == "⟨U+D800⟩ \U0001f600 é"


def test_the_timeline(shown: Any) -> None:
    page = shown(animation={"seconds": 2, "fps": 10, "frames": 20, "loop": True})
    ask(page, "document.body.append(timeline(viewer).box)")
    assert page.locator("output").text_content() == "0.00 / 2 s"
    page.get_by_text("Play").click()
    assert ask(page, "viewer.playing")
    put(page, ".time", "13")
    assert ask(page, "[viewer.playing, viewer.frame]") == [False, 13]
    assert page.locator("output").text_content() == "1.30 / 2 s"
    assert page.get_by_text("Play").count() == 1


def test_steering_by_mouse_touch_and_keys(shown: Any) -> None:
    page = shown("canvas(64, 48); camera(eye = [0, 0, 4]); sphere;")
    ask(page, "(steer(viewer), document.body.append(cameraControls(viewer).box))")
    ask(page, "void (canvas.style.width = '200px')")

    def eye() -> list[float]:
        found: list[float] = ask(page, "viewer.camera.eye")
        return found

    box = page.locator("#canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 75, y)
    page.mouse.up()
    assert eye() == pytest.approx([4, 0, 0], abs=1e-9), "half the shorter side is a quarter of the way round"
    page.mouse.move(x, y - 40)
    assert eye() == pytest.approx([4, 0, 0], abs=1e-9), "no button is down"
    page.get_by_text("Reset camera").click()
    assert eye() == [0, 0, 4]
    page.locator("#canvas").focus()
    page.keyboard.press("ArrowUp")
    assert eye()[1] > 0.3
    page.keyboard.press("Home")
    page.keyboard.press("+")
    assert eye() == pytest.approx([0, 0, 4 / 1.1])
    page.keyboard.press("-")
    page.keyboard.press("Shift+ArrowRight")
    assert ask(page, "viewer.camera.target[0]") > 0
    page.keyboard.press("0")
    page.mouse.move(x, y)
    page.mouse.wheel(0, 100)
    page.wait_for_function("() => viewer.moved")
    assert eye()[2] > 4
    page.keyboard.press("0")
    touch = """(moves) => {
      for (const [type, id, x, y] of moves) {
        const given = { pointerId: id, pointerType: "touch", clientX: x, clientY: y, buttons: 1 };
        canvas.dispatchEvent(new PointerEvent(type, given));
      }
    }"""
    ask(page, "void (canvas.setPointerCapture = () => {})")
    down = [["pointerdown", 1, x - 10, y], ["pointerdown", 2, x + 10, y]]
    page.evaluate(touch, [*down, ["pointermove", 1, x - 30, y], ["pointermove", 2, x + 30, y]])
    assert eye()[2] == pytest.approx(4 / 3), "two fingers thrice as far apart"
    page.evaluate(touch, [["pointermove", 1, x - 30, y + 30], ["pointermove", 2, x + 30, y + 30]])
    assert ask(page, "viewer.camera.target[1]") > 0
    page.evaluate(touch, [["pointerup", 1, x, y], ["pointercancel", 2, x, y], ["pointermove", 1, 0, 0]])
    page.get_by_text("Copy camera line").click()
    page.wait_for_function("() => document.body.innerText.includes('Copied')")
