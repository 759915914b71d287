"""What all pages of a server share: the folder, what is not saved, the processes that draw."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Collection, Coroutine
from importlib.resources import files
from pathlib import Path
from typing import Any, Protocol

from scenelang.backend.options import usable_cores
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.play.folder import Folder
from scenelang.play.journal import Journal
from scenelang.play.made import Files
from scenelang.play.messages import MOST_SIDE, Json
from scenelang.play.pool import Pool

log = logging.getLogger("scenelang.play")


class Page(Protocol):
    """A page that is open."""

    @property
    def names(self) -> Collection[str]:
        """The files that it shows."""

    def tell(self, message: Json | str) -> None:
        """Send it a message."""

    def changed(self, name: str, text: str | None, disk: str | None) -> None:
        """Tell it what a file holds now."""

    def imported(self, path: Path) -> None:
        """Show again what imports a file that has changed."""


class Play:
    """What all pages share.

    Args:
        folder: the scenes.
        first: the one to show at first.
        journal: keeps what is not saved.
    """

    def __init__(self, folder: Folder, first: str | None = None, journal: Journal | None = None) -> None:
        self.folder, self.first = folder, first
        self.journal = journal if journal is not None else Journal()
        most = max(3, usable_cores())
        self.quick = Pool(most)  # pictures that are looked at while typing
        self.views = Pool(most, nice=5)  # which stand back for them
        self.slow = Pool(2, nice=10)
        self.store = Files()
        self.pages: set[Page] = set()
        self.reading = asyncio.Lock()
        """Held from reading or writing a file to telling pages of it: what is older is told first."""
        self._tasks: set[asyncio.Future[Any]] = set()
        self._listed: list[str] | None = None

    def later(self, work: Coroutine[Any, Any, Any]) -> None:
        """Do something beside all else."""

        def ended(task: asyncio.Future[Any]) -> None:
            self._tasks.discard(task)
            if not task.cancelled() and (error := task.exception()) is not None:
                log.error("%r", error)

        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(ended)

    async def close(self) -> None:
        """End whatever goes on."""
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for pool in (self.quick, self.views, self.slow):
            await pool.close()

    async def files(self) -> Json:
        """The message that lists what there is."""
        self._listed = await asyncio.to_thread(self.folder.names)
        return {
            "kind": "files",
            "files": self._listed,
            "examples": _examples(),
            "folder": self.folder.path.name,
            "open": self.first if self.first is not None else next(iter(self._listed), None),
            "uri": f"{self.folder.path.as_uri()}/",
            "most": {"bytes": MAX_BYTES, "side": MOST_SIDE},
        }

    async def refresh(self) -> None:
        """Tell all pages what there is, if that has changed."""
        before = self._listed
        message = await self.files()
        if self._listed != before:
            for page in self.pages:
                page.tell(message)

    async def write(self, name: str, text: str, base: str | None, page: Page) -> str:
        """Write a file for a page, and tell the others; the file's digest. Raises as `Folder.write`."""
        async with self.reading:
            disk = await asyncio.to_thread(self.folder.write, name, text, base)
            for other in self.pages:
                if other is not page:
                    other.changed(name, text, disk)
                other.imported(self.folder.path / name)
            if self._listed is not None and name not in self._listed:
                await self.refresh()
            return disk

    def keep(self, path: Path, text: str, saved: str, disk: str | None) -> None:
        """Keep a text that is not saved; where it is, forget what was kept."""
        try:
            if text == saved:
                self.journal.drop(path)
            else:
                self.journal.keep(path, text, disk)
        except OSError as error:
            log.warning("unsaved text is not kept: %s", error)


def _examples() -> list[str]:
    """Scenes that come with the page."""
    folder = files("scenelang").joinpath("play/web/examples")
    found = folder.iterdir() if folder.is_dir() else ()
    return sorted(place.name for place in found if place.name.endswith(".nsg"))
