"""Messages of pages to a server: pictures, files, attacks, and those of the language server."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import io
import itertools
import json
import math
import signal
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

import scenelang as nsg
from scenelang.web import folder as folders
from scenelang.web import server as watching
from scenelang.web.folder import Folder, Journal
from scenelang.web.language import checked
from scenelang.web.live import Live, Play
from tests.play.client import WAIT_S, Page, Server
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
    assert difference["size"] == [3 * 64 + 8, 48 + 28]
    assert np.array_equal(pixels(difference)[28:, 68:132], exact)
    page.draw("f", "a.nsg", by="figures")
    figures = page.until("figures", id="f")
    assert (figures["objects"], figures["rows"], figures["canvas"]) == (1, 1, [64, 48])
    assert figures["psnr"] == difference["psnr"] > 40


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
    (folder / "renamed.nsg").unlink()


def test_unsaved_text_outlives_a_crash(tmp_path: Path) -> None:
    scenes, state = tmp_path / "scenes", tmp_path / "state"
    scenes.mkdir()
    (scenes / "a.nsg").write_text(SQUARE)
    with Server(scenes / "a.nsg", state) as first, first.page() as page:
        assert page.files["open"] == "a.nsg"
        base = page.open("a.nsg")["disk"]
        page.say("edit", file="a.nsg", version=1, text="star; // not saved")
        while not any(path.stat().st_size for path in state.rglob("*.json")):  # within a second
            page.draw(1, "a.nsg")
            page.until("picture")
        first.end(signal.SIGKILL)
    with Server(scenes, state) as second, second.page() as page:
        text = page.open("a.nsg")
        assert text["text"] == SQUARE
        assert (text["unsaved"]["text"], text["unsaved"]["disk"]) == ("star; // not saved", base)
        page.say("edit", file="a.nsg", version=1, text="star; // not saved")
        page.say("save", file="a.nsg", version=1, text="star; // not saved", base=base)
        page.until("saved")
        assert page.open("a.nsg")["unsaved"] is None
    assert not list(state.rglob("*.json"))
    assert [path.name for path in scenes.iterdir()] == ["a.nsg"]


def test_downloads(server: Server, page: Page, folder: Path) -> None:
    text = f"animate(seconds = 1, fps = 4);\n{SQUARE.replace('0.5', '0.2 + 0.2 * u')}"
    (folder / "film.nsg").write_text(text)
    page.open("film.nsg")
    for kind in ("png", "gif", "html", "nsg"):
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


def test_files_of_the_package_and_no_others(server: Server) -> None:
    """Static files: the page's and the viewer's, whatever else a path says."""

    def get(path: str) -> int:
        try:
            with urllib.request.urlopen(f"{server.url}{path}") as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            with error:
                return error.code

    assert get("static/viewer/gl.js") == get("static/codemirror.js") == 200
    for path in (
        *(
            "static/../app.py",
            "static/%2e%2e/app.py",
            "static/viewer/../view.py",
            "static/viewer/%2e%2e%2fa.py",
        ),
        *("static//etc/passwd", "static/..%5capp.py", "static/web", "static/", "static/.", "static/viewer"),
        *("static/play.js%00.py", "static/viewer/gl.js/x", "app.py", "download", "download?key=", "live"),
    ):
        assert get(path) in (403, 404, 405), path


# Loops that end at a limit of the language after seconds, and what has no end but limits.
BOMBS = (
    "for (i in 0..1000000000) { square; }",
    "fn f(x) = f(x) + f(x); square { scale(f(1)); }",
    "module m() { m(); m(); } m();",
    "for (i in 0..99999) { for (j in 0..99999) { square; } }",
    "canvas(100000, 100000); square;",
)


MALFORMED = (
    *("", "{", "null", "[]", "7", '"x"', "[" * 100_000),
    *('{"kind": 7}', '{"kind": "nothing"}', '{"kind": "__class__"}', '{"kind": "open"}'),
    *('{"kind": "open", "file": {"a": 1}}', '{"kind": "open", "kind": "edit"}'),
    '{"kind": "edit", "file": "a.nsg", "version": 1, "text": "x"}',  # not open
    '{"kind": "draw", "file": "a.nsg", "id": 1, "by": "network", "params": {}}',
    *('{"kind": "cancel", "id": {"a": []}}', '{"kind": "cancel", "id": NaN}'),
    '{"kind": "open", "file": "\\ud800.nsg"}',
)
WRONG: tuple[dict[str, Any], ...] = (
    *({"size": size} for size in ([0, 10], [9000, 10], [10.5, 10], "64x64", [8192, 8192])),
    *({"frame": frame} for frame in (-1, 1e9, True)),
    *({"by": by} for by in ("view", "../network")),
    *({"id": id} for id in (None, 1.5)),
    *({"params": params} for params in ([1], {"nobody": 1}, {"nobody": {"__class__": 1}})),
)


def test_malformed_messages_are_answered(page: Page) -> None:
    for text in MALFORMED:
        page.socket.send(text)
        assert page.until("error")["message"]
    page.open("b.nsg")


def test_wrong_wishes_are_answered(page: Page) -> None:
    page.open("b.nsg")
    for wrong in WRONG:
        page.draw(**{"id": 3, "file": "b.nsg", **wrong})
        page.until("error")
    for text in ("\ud800", "x" * 10_000_001):
        page.say("edit", file="b.nsg", version=1, text=text)
        page.until("error", file="b.nsg")
    page.draw(4, "b.nsg")
    page.until("picture", id=4)


def test_who_does_not_listen_is_given_up() -> None:

    class Deaf:
        def __init__(self) -> None:
            self.sent, self.closed = 0, False

        async def accept(self) -> None:
            pass

        async def receive_text(self) -> str:
            return await asyncio.get_running_loop().create_future()

        async def send_text(self, text: str) -> None:
            self.sent += 1
            await asyncio.get_running_loop().create_future()

        async def close(self) -> None:
            self.closed = True

    async def run(tmp: Path) -> Deaf:
        socket = Deaf()
        live = Live(Play(Folder(tmp), journal=Journal(tmp)), socket)  # type: ignore[arg-type]
        running = asyncio.create_task(live.run())
        async with asyncio.timeout(60):
            while not running.done():
                live.tell("x" * (1 << 22))
                await asyncio.sleep(0)
        return socket

    deaf = asyncio.run(run(Path(__file__).parent))
    assert (deaf.sent, deaf.closed) == (1, True)


def test_an_oversized_message_ends_its_page_alone(server: Server, page: Page) -> None:
    with server.page() as other:
        with contextlib.suppress(ConnectionClosed):
            other.socket.send("x" * (40 << 20))
        with pytest.raises(ConnectionClosed):
            other.hear()
        page.open("b.nsg")


def test_bombs_keep_nobody_waiting(server: Server, page: Page) -> None:
    with server.page() as other:
        for one in (page, other):
            one.open("b.nsg")
        for at, bomb in enumerate(BOMBS):
            page.say("edit", file="b.nsg", version=3 * at + 1, text=bomb)
            page.draw(1, "b.nsg", size=None)
            page.draw(2, "b.nsg", by="reference", size=None)
            other.draw(3, "b.nsg")
            other.until("picture", id=3)
            # a newer text takes the place of the bomb's, whatever that was doing
            page.say("edit", file="b.nsg", version=3 * at + 2, text=SQUARE)
            page.draw(4, "b.nsg")
            page.until("picture", id=4, version=3 * at + 2)
            page.say("edit", file="b.nsg", version=3 * at + 3, text=bomb)
            assert page.until("view", version=3 * at + 3)["view"] is None, bomb
        page.say("discard", file="b.nsg")


def test_a_flood_of_drawings(page: Page) -> None:
    """Each is answered once; the last is drawn."""
    page.open("b.nsg")
    count = 300
    for number in range(count):
        page.draw(number, "b.nsg", size=[400 + number % 7, 300])
    answers: dict[int, str] = {}
    while len(answers) < count:
        message = page.hear()
        assert message["id"] not in answers
        answers[message["id"]] = message["kind"]
    assert set(answers.values()) <= {"picture", "cancelled"}
    assert answers[count - 1] == "picture"


def test_cancelling(page: Page) -> None:
    page.open("b.nsg")
    page.draw("slow", "b.nsg", by="reference", size=[2000, 2000])
    page.say("cancel", id="slow")
    page.until("cancelled", id="slow")
    page.draw("next", "b.nsg", by="reference")
    page.until("picture", id="next")


class Editor:
    """A client of the protocol."""

    def __init__(self, socket: ClientConnection, folder: Path) -> None:
        self.socket, self.folder, self._ids = socket, folder, itertools.count(1)
        self.request("initialize", {"capabilities": {}, "processId": 1, "rootUri": "file:///etc"})
        self.notify("initialized", {})

    def notify(self, method: str, params: Any) -> None:
        self.socket.send(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))

    def request(self, method: str, params: Any) -> Any:
        id = next(self._ids)
        self.socket.send(json.dumps({"jsonrpc": "2.0", "id": id, "method": method, "params": params}))
        while (message := self.hear()).get("id") != id:
            pass
        return message.get("result", message.get("error"))

    def hear(self) -> Any:
        return json.loads(self.socket.recv(WAIT_S))

    def open(self, name: str, text: str) -> str:
        uri = (self.folder / name).as_uri()
        item = {"uri": uri, "languageId": "nsg", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": item})
        return uri

    def diagnostics(self, uri: str, evaluated: bool) -> list[Any]:
        """What is said of a file: at once of its syntax, then of its evaluation."""
        for _ in range(2 if evaluated else 1):
            message = self.hear()
            while (
                message.get("method") != "textDocument/publishDiagnostics" or message["params"]["uri"] != uri
            ):
                message = self.hear()
        found: list[Any] = message["params"]["diagnostics"]
        return found


@pytest.fixture(scope="module")
def editor(server: Server) -> Iterator[Editor]:
    with server.connect("lsp") as socket:
        yield Editor(socket, server.folder)  # type: ignore[attr-defined]


def test_an_editor_of_the_page(editor: Editor) -> None:
    uri = editor.open("unsaved.nsg", SQUARE.replace("square", "sqare"))
    (found,) = editor.diagnostics(uri, evaluated=True)
    assert "sqare" in found["message"]
    place = {"textDocument": {"uri": uri}, "position": {"line": 1, "character": 12}}
    assert "scale" in json.dumps(editor.request("textDocument/hover", place))
    assert editor.request("textDocument/completion", place)["items"]


def test_imports_stay_in_the_folder(editor: Editor, folder: Path) -> None:
    (folder.parent / "outside.nsg").write_text("let secret = 1;")
    uri = editor.open("out.nsg", 'import "../outside.nsg" as out;\nsquare { scale(out.secret); }')
    assert [d["code"] for d in editor.diagnostics(uri, evaluated=True)] == ["E0215"]


def test_other_files_are_refused(editor: Editor, folder: Path) -> None:
    for uri in ("file:///etc/passwd", "file:///x.nsg", "FILE:///x.nsg", "file://host/x.nsg"):
        assert "outside" in editor.request("textDocument/hover", {"textDocument": {"uri": uri}})["message"]
        item = {"uri": uri, "languageId": "nsg", "version": 1, "text": 'import "a.nsg" as a;'}
        editor.notify("textDocument/didOpen", {"textDocument": item})
    there = editor.open("a.nsg", SQUARE)
    assert editor.diagnostics(there, evaluated=False) == []  # it is the first that anything is said of


def test_malformed_messages(editor: Editor) -> None:
    for text in ("", "{", "[]", "7", "[" * 100_000, '{"method": 1}', '{"jsonrpc": "2.0"}'):
        editor.socket.send(text)
    uri = editor.open("b.nsg", SQUARE)
    assert editor.diagnostics(uri, evaluated=True) == []


def test_what_goes_on(tmp_path: Path) -> None:
    """The folder is the server's, links lead nowhere else, and settings of places are dropped."""
    inside = tmp_path / "in"
    inside.mkdir()
    (inside / "link.nsg").symlink_to(tmp_path / "out.nsg")
    folder = Folder(inside, tmp_path)
    given = {
        "rootUri": "file:///",
        "rootPath": "/",
        "workspaceFolders": [{"uri": "file:///", "name": "all"}],
        "initializationOptions": {"scenelang": {"root": "/", "model": "x", "debounceMs": 50}},
        "capabilities": {"general": {}},
    }
    passed = checked({"method": "initialize", "id": 1, "params": given}, folder)["params"]
    assert passed["rootUri"] == inside.as_uri()
    assert passed["workspaceFolders"] == [{"uri": inside.as_uri(), "name": "in"}]
    assert passed["initializationOptions"] == {"debounceMs": 50, "root": str(tmp_path)}
    assert "rootPath" not in passed
    changed = {"method": "workspace/didChangeConfiguration", "params": {"settings": {"root": "/"}}}
    assert checked(changed, folder)["params"] == {"settings": {"root": str(tmp_path)}}
    for uri in (f"{inside.as_uri()}/../out.nsg", (inside / "link.nsg").as_uri(), f"{inside.as_uri()}x/a.nsg"):
        with pytest.raises(ValueError, match="outside"):
            checked({"method": "m", "params": {"changes": [{"newUri": uri}]}}, folder)
    text = {"textDocument": {"uri": f"{inside.as_uri()}/a.nsg", "text": "file:///etc"}}
    assert checked({"method": "m", "params": text}, folder)["params"] == text


class Listener:
    """A page that notes what it is told."""

    def __init__(self) -> None:
        self.open = {"a.nsg"}
        self.told: list[Any] = []

    def tell(self, message: Any) -> None:
        self.told.append(message["files"])

    def changed(self, name: str, text: str | None, disk: str | None) -> None:
        self.told.append((name, text))

    def imported(self, path: Path) -> None:
        self.told.append(path.name)


@pytest.mark.parametrize("way", ["told", "large", "polling"])
def test_changes_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    inside = tmp_path / "in"
    inside.mkdir()
    (inside / "a.nsg").write_text("square;")
    asked: list[dict[str, Any]] = []
    real = watching.awatch

    def awatch(*paths: Path, **options: Any) -> Any:
        asked.append(options)
        if way == "polling" and not options["force_polling"]:
            raise OSError(28, "no space left on device")  # what Linux says where there are too many watches
        return real(*paths, **options)

    monkeypatch.setattr(watching, "awatch", awatch)
    monkeypatch.setattr(watching, "SLOW_MS", 50)
    if way == "large":
        monkeypatch.setattr(folders, "MOST_LOOKED", 0)

    async def run() -> None:
        play, page, stop = Play(Folder(inside), journal=Journal(tmp_path)), Listener(), asyncio.Event()
        play.pages.add(page)
        watcher = asyncio.create_task(watching.watch(play, stop))
        count = 0
        async with asyncio.timeout(60):
            while not any(isinstance(told, tuple) for told in page.told):
                (inside / "a.nsg").write_text(f"star; // {(count := count + 1)}")
                await asyncio.sleep(0.2)
            (inside / "other.txt").write_text("nothing to tell")
            (inside / "b.nsg").write_text("square;")
            while ["a.nsg", "b.nsg"] not in page.told:
                await asyncio.sleep(0.05)
        assert page.told.count(["a.nsg", "b.nsg"]) == 1
        stop.set()
        await watcher
        await play.close()

    asyncio.run(run())
    assert [options["recursive"] for options in asked] == {
        "told": [True],
        "large": [False],
        "polling": [True, False],
    }[way]


class Slow(Folder):
    """Hands out what it first reads only when it may."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.has_read, self.may_go, self.first = threading.Event(), threading.Event(), True

    def read(self, name: str) -> tuple[str | None, str | None]:
        found = super().read(name)
        if self.first:
            self.first = False
            self.has_read.set()
            assert self.may_go.wait(20)
        return found


def test_what_was_read_before_a_save_is_not_told_behind_it(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text("square;\n")
    folder = Slow(tmp_path)
    _, base = Folder(tmp_path).read("a.nsg")

    async def both() -> list[Any]:
        play, page, saver = Play(folder, journal=Journal(tmp_path / "kept")), Listener(), Listener()
        play.pages |= {page, saver}
        looks = asyncio.create_task(watching._reread(play, "a.nsg"))
        await asyncio.to_thread(folder.has_read.wait, 20)
        saves = asyncio.create_task(play.write("a.nsg", "star;\n", base, saver))
        await asyncio.wait([saves], timeout=0.3)
        folder.may_go.set()
        await asyncio.gather(looks, saves)
        return [told[1] for told in page.told if isinstance(told, tuple)]

    assert asyncio.run(both()) == ["square;\n", "star;\n"]
    assert (tmp_path / "a.nsg").read_text() == "star;\n"


SKY = "canvas(32, 24); param r = 0.4 in 0.1..1; sky(); sphere { scale(r); %s }"


def test_a_view_under_a_sky_is_a_draft_and_then_has_light(page: Page, folder: Path) -> None:
    """The first has light of the bare sky, the second light that objects hide; what reflects is matte."""
    (folder / "sky.nsg").write_text(SKY % "material metal { roughness(r); }")
    page.say("open", file="sky.nsg")
    first, second = page.until("view", file="sky.nsg"), page.until("view", file="sky.nsg")
    assert ("again" in first, second["again"], first["problems"], second["problems"]) == (False, True, [], [])
    views = [json.loads(each["view"]) for each in (first, second)]
    assert [view["params"][0]["name"] for view in views] == ["r", "r"]
    nodes = [np.prod(view["around"]["sides"]) for view in views]
    assert nodes[0] < 100 < nodes[1] < 4000
    assert [view.pop("around") and view.pop("blob") for view in views]
    assert views[0] == views[1]
    page.say("edit", file="sky.nsg", text=SKY % "material", version=1)  # a mistake
    assert page.until("view", version=1)["view"] is None
    page.say("edit", file="sky.nsg", text="sphere;", version=2)
    page.until("view", version=2)
    page.draw(1, "sky.nsg")
    page.until("picture", id=1)
    assert [m["kind"] for m in page.told if m.get("version") == 2] == ["view", "picture"]
