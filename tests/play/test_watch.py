"""Changes of the folder reach the pages, however the system tells of them."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path
from typing import Any

import pytest

from scenelang.web import folder as folders
from scenelang.web import server as watching
from scenelang.web.folder import Folder, Journal
from scenelang.web.live import Play


class Page:
    """One that notes what it is told."""

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
        play, page, stop = Play(Folder(inside), journal=Journal(tmp_path)), Page(), asyncio.Event()
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
        play, page, saver = Play(folder, journal=Journal(tmp_path / "kept")), Page(), Page()
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
