"""What a page says and is told, with a server in a process of its own."""

from __future__ import annotations

import base64
import contextlib
import io
import json
import math
import signal
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from tests.play.client import Page, Server
from tests.play.conftest import SQUARE


def pixels(message: dict[str, Any]) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(message["png"]))).convert("RGB")).astype(int)


def by_kind(told: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    return next(message for message in told if message["kind"] == kind)


def picture_of(text: str, **options: Any) -> np.ndarray:
    return nsg.render(nsg.loads(text, **options.pop("load", {})), **options).to_uint8().astype(int)


def test_an_edit_is_drawn_as_the_command_line_draws_it(page: Page) -> None:
    assert page.files["files"] == ["a.nsg", "b.nsg"]
    text = page.open("a.nsg")
    assert (text["text"], text["version"], text["unsaved"]) == (SQUARE, 0, None)
    edited = "param k = 0.2 in 0..1; param tilt = 0deg;\n" + SQUARE.replace(
        "scale(0.5)", "scale(k); rotate(tilt)"
    )
    page.say("edit", file="a.nsg", version=1, text=edited)
    page.draw(7, "a.nsg", params={"k": 0.9, "tilt": "30deg"}, size=[80, 60])
    told = [page.hear() for _ in range(2)]
    page.draw(8, "a.nsg", params={"k": 0.9, "tilt": math.radians(30)}, size=[80, 60])
    assert np.array_equal(pixels(page.until("picture", id=8)), pixels(by_kind(told, "picture")))
    view = by_kind(told, "view")
    assert (view["version"], view["problems"]) == (1, [])
    assert json.loads(view["view"])["dimension"] == 2
    drawn = by_kind(told, "picture")
    assert (drawn["id"], drawn["version"], drawn["size"]) == (7, 1, [80, 60])
    defines = {"k": 0.9, "tilt": "30deg"}
    expected = picture_of(edited, load={"params": defines}, size=(80, 60))
    assert np.abs(pixels(drawn) - expected).max() <= 1
    page.say("discard", file="a.nsg")


def test_reference_difference_and_figures(page: Page) -> None:
    page.open("a.nsg")
    page.draw("r", "a.nsg", by="reference")
    exact = pixels(page.until("picture", id="r"))
    assert np.abs(exact - picture_of(SQUARE, backend="reference")).max() <= 1
    page.draw("d", "a.nsg", by="difference")
    difference = page.until("picture", id="d")
    assert difference["size"] == [3 * 64 + 8, 48 + 14]
    assert np.array_equal(pixels(difference)[14:, 68:132], exact)
    page.draw("f", "a.nsg", by="figures")
    figures = page.until("figures", id="f")
    assert (figures["objects"], figures["rows"], figures["canvas"]) == (1, 1, [64, 48])
    assert figures["psnr"] == difference["psnr"] > 40


def test_mistakes_are_told_and_the_picture_fails(page: Page) -> None:
    page.open("b.nsg")
    page.say("edit", file="b.nsg", version=5, text="\n square { scale(); ")
    view = page.until("view", version=5)
    assert view["view"] is None
    assert {problem["line"] for problem in view["problems"]} == {2}
    page.draw(1, "b.nsg")
    assert page.until("error")["id"] == 1
    page.say("discard", file="b.nsg")


def test_what_no_page_draws_the_network_does(page: Page) -> None:
    page.open("b.nsg")
    text = "canvas(64, 48); for (i in 0..5000) { square { scale(0.01); translate(i / 5000, 0); } }"
    page.say("edit", file="b.nsg", version=1, text=text)
    page.draw(1, "b.nsg")
    told = [page.hear() for _ in range(2)]
    view = by_kind(told, "view")
    assert view["view"] is None
    assert [problem["severity"] for problem in view["problems"]][-1] == "warning"
    assert "5,000 objects" in view["problems"][-1]["message"]
    assert by_kind(told, "picture")["id"] == 1
    page.say("discard", file="b.nsg")


# ---------------------------------------------------------------- files


def test_saving_and_what_changes_on_the_disk(server: Server, folder: Path) -> None:
    file = folder / "both.nsg"
    file.write_text("square;\n")
    with server.page() as page, server.page() as other:
        for one in (page, other):
            base = one.open("both.nsg")["disk"]
        page.say("edit", file="both.nsg", version=1, text="star;\n")
        page.until("view", version=1)
        page.say("save", file="both.nsg", version=1, text="star;\n", base=base)
        saved = page.until("saved")
        assert file.read_text() == "star;\n"
        assert other.until("text")["text"] == "star;\n"
        # another program
        replaced = folder / "new.tmp"
        replaced.write_text("disc;\n")
        replaced.rename(file)
        changed = page.until("text", origin="disk")
        assert changed["text"] == "disc;\n"
        page.until("view")
        # saved by the page at the same time: nothing is lost
        page.say("save", file="both.nsg", version=2, text="mine;\n", base=saved["disk"])
        conflict = page.until("conflict")
        assert (conflict["text"], file.read_text()) == ("disc;\n", "disc;\n")
        page.say("save", file="both.nsg", version=2, text="mine;\n", base=conflict["disk"])
        page.until("saved")
        assert file.read_text() == "mine;\n"
        # the page's own saves were not told back
        assert [m["text"] for m in page.told if m["kind"] == "text"] == ["square;\n", "disc;\n"]
        # what is told meanwhile is no longer what the unsaved text was made from
        page.say("edit", file="both.nsg", version=3, text="mine; star;\n")
        file.write_text("theirs;\n")
        page.until("text", text="theirs;\n")
        with server.page() as third:
            while not (lost := third.open("both.nsg"))["unsaved"]:  # kept within a second
                pass
            assert lost["unsaved"]["text"] == "mine; star;\n"
            assert lost["unsaved"]["disk"] != lost["disk"]
        page.say("discard", file="both.nsg")
        file.unlink()
        assert page.until("text")["text"] is None
        assert "both.nsg" not in page.until("files")["files"]


def test_a_file_that_is_imported_is_shown_with_its_unsaved_text(page: Page, folder: Path) -> None:
    (folder / "lib.nsg").write_text("module thing() { square { material flat { color(#f00); } } }\n")
    (folder / "use.nsg").write_text('canvas(64, 48);\nimport "lib.nsg" as lib;\nlib.thing();\n')
    page.open("use.nsg")
    page.open("lib.nsg")
    star = "star { material flat { color(#070); } }"
    page.say("edit", file="lib.nsg", version=1, text=f"module thing() {{ {star} }}\n")
    assert page.until("view", file="use.nsg")["problems"] == []
    page.draw(1, "use.nsg")
    assert np.abs(pixels(page.until("picture")) - picture_of(f"canvas(64, 48); {star}")).max() <= 1
    page.say("discard", file="lib.nsg")
    page.until("view", file="lib.nsg")
    (folder / "lib.nsg").write_text("module thing() { nothing_like_it; }\n")
    assert page.until("view", file="use.nsg", view=None)["problems"]


def test_files_are_made_listed_and_renamed(page: Page, folder: Path) -> None:
    assert page.open("deep/new.nsg")["text"] is None
    page.say("save", file="deep/new.nsg", version=1, text="star;\n", base=None)
    assert "deep/new.nsg" in page.until("files")["files"]
    page.say("rename", file="deep/new.nsg", to="renamed.nsg")
    files = page.until("files")["files"]
    assert "renamed.nsg" in files
    assert "deep/new.nsg" not in files
    page.draw(1, "renamed.nsg")
    page.until("picture", id=1)
    for file in ("../x.nsg", "/etc/passwd", "a\0.nsg", "con.nsg"):
        page.say("open", file=file)
        page.until("error", file=file)
        page.say("rename", file="renamed.nsg", to=file)
        page.until("error", file="renamed.nsg")
    (folder / "renamed.nsg").unlink()


@pytest.mark.parametrize("how", ["page", "server"])
def test_unsaved_text_outlives_a_crash(tmp_path: Path, how: str) -> None:
    scenes, state = tmp_path / "scenes", tmp_path / "state"
    scenes.mkdir()
    (scenes / "a.nsg").write_text(SQUARE)
    with Server(scenes / "a.nsg", state) as first, first.page() as page:
        assert page.files["open"] == "a.nsg"
        base = page.open("a.nsg")["disk"]
        page.say("edit", file="a.nsg", version=1, text="star; // not saved")
        page.until("view", version=1)
        if how == "server":
            while not any(path.stat().st_size for path in state.rglob("*.json")):  # within a second
                page.draw(1, "a.nsg")
                page.until("picture")
            first.end(signal.SIGKILL)
        with contextlib.ExitStack() as stack:
            server = first if how == "page" else stack.enter_context(Server(scenes, state))
            page.socket.close()
            _comes_back(server, base)
    assert not list(state.rglob("*.json"))
    assert [path.name for path in scenes.iterdir()] == ["a.nsg"]


def _comes_back(server: Server, base: str | None) -> None:
    with server.page() as page:
        text = page.open("a.nsg")
        assert text["text"] == SQUARE
        assert (text["unsaved"]["text"], text["unsaved"]["disk"]) == ("star; // not saved", base)
        page.say("edit", file="a.nsg", version=1, text="star; // not saved")
        page.say("save", file="a.nsg", version=1, text="star; // not saved", base=base)
        page.until("saved")
        assert page.open("a.nsg")["unsaved"] is None


# ---------------------------------------------------------------- downloads


@pytest.mark.parametrize("kind", ["png", "gif", "webp", "html", "nsg"])
def test_downloads(server: Server, page: Page, folder: Path, kind: str) -> None:
    text = f"animate(seconds = 1, fps = 4);\n{SQUARE.replace('0.5', '0.2 + 0.2 * u')}"
    (folder / "film.nsg").write_text(text)
    page.open("film.nsg")
    page.say("download", id="d", file="film.nsg", **{"as": kind}, frame=2, size=[80, 60], params={})
    ready = page.until("ready")
    assert ready["name"] == f"film.{kind}"
    address = f"{server.url}{ready['url']}"
    with urllib.request.urlopen(address) as answer:
        data = answer.read()
        assert answer.headers["content-disposition"].startswith("attachment")
    assert len(data) == ready["bytes"]
    with pytest.raises(urllib.error.HTTPError):  # once
        urllib.request.urlopen(address)
    if kind == "nsg":
        assert data.decode() == text
    elif kind == "html":
        assert b"<html" in data[:200].lower()
    else:
        picture = Image.open(io.BytesIO(data))
        assert picture.size == (80, 60)
        assert getattr(picture, "n_frames", 1) == (1 if kind == "png" else 4)
        assert kind == "png" or page.told[-2]["kind"] == "progress"
