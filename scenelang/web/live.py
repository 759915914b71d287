"""One page that is open, and what all pages of a server share."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from collections.abc import Callable, Coroutine
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect

from scenelang.assets.files import read_json
from scenelang.drawing.how import usable_cores
from scenelang.language.limits import MAX_BYTES
from scenelang.web.folder import (
    MOST_SIDE,
    Answer,
    Changed,
    Denied,
    Files,
    Folder,
    JobFailed,
    Journal,
    Json,
    choice_of,
    id_of,
    string_of,
    text_of,
    whole_of,
    wishes,
)
from scenelang.web.pool import Pool

log = logging.getLogger("scenelang.play")
EXAMPLES: Final = files("scenelang").joinpath("web/editor/examples")  # scenes that come with the page


class Play:
    """The state that all pages share: the scenes, the one to show at first, and unsaved texts."""

    def __init__(self, folder: Folder, first: str | None = None, journal: Journal | None = None) -> None:
        self.folder, self.first = folder, first
        self.journal = journal if journal is not None else Journal()
        most = max(3, usable_cores())
        self.quick = Pool(most)  # pictures that are looked at while typing
        self.views = Pool(most, nice=5)  # which stand back for them
        self.slow = Pool(2, nice=10)
        self.store = Files()
        self.pages: set[Live] = set()
        self.reading = asyncio.Lock()
        """Held from reading or writing a file until pages are told, so that they hear of changes in order."""
        self._tasks: set[asyncio.Task[Any]] = set()
        self._listed: list[str] | None = None

    def later(self, work: Coroutine[Any, Any, Any]) -> None:
        """Run a task in the background."""

        def ended(task: asyncio.Task[Any]) -> None:
            self._tasks.discard(task)
            if not task.cancelled() and (error := task.exception()) is not None:
                log.error("%r", error)

        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(ended)

    async def close(self) -> None:
        """Cancel all tasks and end all processes."""
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for pool in (self.quick, self.views, self.slow):
            await pool.close()

    async def files(self) -> Json:
        """The message that lists the scenes and examples."""
        self._listed = await asyncio.to_thread(self.folder.names)
        return {
            "kind": "files",
            "files": self._listed,
            "examples": sorted(place.name for place in EXAMPLES.iterdir() if place.name.endswith(".nsg")),
            "folder": self.folder.path.name,
            "open": self.first if self.first is not None else next(iter(self._listed), None),
            "uri": f"{self.folder.path.as_uri()}/",
            "most": {"bytes": MAX_BYTES, "side": MOST_SIDE},
        }

    async def refresh(self) -> None:
        """Send all pages the list of files, if it has changed."""
        before = self._listed
        message = await self.files()
        if self._listed != before:
            for page in self.pages:
                page.tell(message)

    async def write(self, name: str, text: str, base: str | None, page: Live) -> str:
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
        """Store a text that is not saved; drop the stored one where it is."""
        try:
            if text == saved:
                self.journal.drop(path)
            else:
                self.journal.keep(path, text, disk)
        except OSError as error:
            log.warning("unsaved text is not kept: %s", error)


FILES: Final = {kind: f"image/{kind}" for kind in ("png", "gif", "webp", "apng")}
FILES.update(html="text/html", nsg="text/plain")
LIMITS_S: Final = {
    **{"view": 20.0, "light": 20.0, "network": 60.0},
    **{"reference": 300.0, "difference": 300.0, "figures": 300.0},
}
FILE_S: Final = 3600.0
KEEP_S: Final = 0.5  # between two times that an unsaved text is stored
MOST_WAITING: Final = 1 << 26  # characters for a page that does not read
MOST_OPEN: Final = 100
MOST_JOBS: Final = 100
Slot = tuple[str, str]
Took = Callable[[Answer], None]


class Open:
    """A file that the page shows."""

    def __init__(self, path: Path, text: str, disk: str | None) -> None:
        self.path = path
        self.text, self.version = text, 0  # of the page
        self.saved, self.disk = text, disk  # the file's, as the page was last sent it
        self.base = disk  # digest of the file that the text is an edit of
        self.wanted: frozenset[Path] = frozenset()  # files that it imports
        self.angles: frozenset[str] = frozenset()  # params in radians
        self.keeping: asyncio.TimerHandle | None = None


class Live:
    """A page's connection."""

    def __init__(self, play: Play, socket: WebSocket) -> None:
        self._play, self._socket = play, socket
        self.open: dict[str, Open] = {}
        self._out: asyncio.Queue[str] = asyncio.Queue()
        self._waiting = 0  # characters in the queue
        self._over = asyncio.Event()
        self._jobs: dict[Slot, tuple[asyncio.Task[None], Any, str]] = {}  # one in each slot, its id and file

    async def run(self) -> None:
        """Answer the page until it is gone."""
        await self._socket.accept()
        self._play.pages.add(self)
        tasks = [asyncio.create_task(work) for work in (self._write(), self._read(), self._over.wait())]
        try:
            self.tell(await self._play.files())
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._play.pages.discard(self)
            for task in (*tasks, *(task for task, _, _ in self._jobs.values())):
                task.cancel()
            for name in list(self.open):
                self._keep(name)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await self._socket.close()

    def tell(self, message: Json | str) -> None:
        """Queue a message; a page that does not read its messages is disconnected."""
        text = message if isinstance(message, str) else json.dumps(message)
        self._waiting += len(text)
        if self._waiting > MOST_WAITING:
            self._over.set()
        else:
            self._out.put_nowait(text)

    async def _write(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                text = await self._out.get()
                await self._socket.send_text(text)
                self._waiting -= len(text)

    async def _read(self) -> None:
        while True:
            try:
                text = await self._socket.receive_text()
            except (WebSocketDisconnect, RuntimeError, KeyError):  # KeyError: bytes, not text
                return
            await asyncio.sleep(0)  # queued messages are sent first, though there may be more to read
            message: Json = {}
            try:
                given = read_json(text.encode("utf-8"))
                message = given if isinstance(given, dict) else {}
                await _ANSWERS[choice_of(message, "kind", _ANSWERS)](self, message)
                continue
            except (Denied, OSError) as error:
                why = str(error)
            except (ValueError, RecursionError) as error:
                why = f"not a message: {error}"
            except Exception as error:
                log.exception("internal error")
                why = f"internal error: {error!r}"
            id, file = message.get("id"), message.get("file")
            id, file = id if isinstance(id, int | str) else None, file if isinstance(file, str) else None
            self.tell({"kind": "error", "id": id, "file": file, "message": why})

    async def _open(self, message: Json) -> None:
        name = string_of(message, "file")
        path = self._play.folder.place(name)
        if name not in self.open and len(self.open) >= MOST_OPEN:
            raise Denied(f"more than {MOST_OPEN} open files")
        kept = await asyncio.to_thread(self._play.journal.find, path)
        async with self._play.reading:
            text, disk = await asyncio.to_thread(self._play.folder.read, name)
        if (known := self.open.get(name)) is None:
            known = self.open[name] = Open(path, text or "", disk)
        lost = kept is not None and kept.text != text
        unsaved = {"text": kept.text, "disk": kept.disk, "seconds": kept.seconds} if kept and lost else None
        known.saved, known.disk = text or "", disk
        if not known.version:
            known.text, known.base = text or "", disk
        said = {"file": name, "text": text, "version": known.version, "disk": disk}
        self.tell({"kind": "text", **said, "origin": "open", "unsaved": unsaved})
        self._view(name)

    async def _edit(self, message: Json) -> None:
        name, known = self._known(message)
        known.text, known.version = text_of(message), whole_of(message, "version", 1, 1 << 53)
        self._cancel(lambda slot, id, file: file == name and slot[0] not in ("file", "view"))
        if known.keeping is None:
            known.keeping = asyncio.get_running_loop().call_later(KEEP_S, self._keep_later, name)
        for other in [name, *(k for k, o in self.open.items() if known.path in o.wanted)]:
            self._view(other)

    async def _save(self, message: Json) -> None:
        name, known = self._known(message)
        base = None if message.get("base") is None else string_of(message, "base")
        text, version = text_of(message), whole_of(message, "version", 0, 1 << 53)
        said = {"file": name, "version": version}
        try:
            # the page is not told of what it has written itself
            disk = await self._play.write(name, text, base, self)
        except Changed as change:
            self.tell({"kind": "conflict", **said, "text": change.text, "disk": change.disk})
            return
        known.saved, known.disk, known.base = text, disk, disk
        if version >= known.version:
            known.text = text
        self._keep(name)
        self.tell({"kind": "saved", **said, "disk": disk})

    async def _discard(self, message: Json) -> None:
        name, known = self._known(message)
        self._unkeep(known)
        known.text, known.base = known.saved, known.disk
        await asyncio.to_thread(self._play.journal.drop, known.path)
        self._view(name)

    async def _close(self, message: Json) -> None:
        name, _ = self._known(message)
        self._keep(name)
        self._cancel(lambda slot, id, file: file == name)
        del self.open[name]

    async def _rename(self, message: Json) -> None:
        name, to = string_of(message, "file"), string_of(message, "to")
        await asyncio.to_thread(self._play.folder.rename, name, to)
        if (known := self.open.pop(name, None)) is not None:
            self._unkeep(known)
            self._play.journal.drop(known.path)
            known.path = self._play.folder.place(to)
            self.open[to] = known
            self._keep(to)
        await self._play.refresh()

    def _known(self, message: Json) -> tuple[str, Open]:
        name = string_of(message, "file")
        if name not in self.open:
            raise Denied(f"`{name[:80]}` is not open")
        return name, self.open[name]

    def _keep_later(self, name: str) -> None:
        if (known := self.open.get(name)) is not None:
            known.keeping = None
            work = asyncio.to_thread(self._play.keep, known.path, known.text, known.saved, known.base)
            self._play.later(work)

    def _keep(self, name: str) -> None:
        """Store the unsaved text of a file now."""
        known = self.open[name]
        self._unkeep(known)
        if known.version:
            self._play.keep(known.path, known.text, known.saved, known.base)

    def _unkeep(self, known: Open) -> None:
        if known.keeping is not None:
            known.keeping.cancel()
            known.keeping = None

    def changed(self, name: str, text: str | None, disk: str | None) -> None:
        """Send the page a file that has changed on the disk."""
        if (known := self.open.get(name)) is None or known.disk == disk:
            return
        clean = known.text == known.saved
        known.saved, known.disk = text or "", disk
        said = {"file": name, "text": text, "version": known.version, "disk": disk}
        self.tell({"kind": "text", **said, "origin": "disk", "unsaved": None})
        if clean:
            known.text, known.base = known.saved, disk
            self._view(name)

    def imported(self, path: Path) -> None:
        """Draw again the scenes that import a file that has changed."""
        for name, known in self.open.items():
            if path in known.wanted:
                self._view(name)

    def _view(self, name: str) -> None:
        version = self.open[name].version

        def viewed(answer: Answer) -> None:
            if (known := self.open.get(name)) is not None:
                known.wanted = frozenset(map(Path, answer.head["wanted"]))
                known.angles = frozenset(answer.head.get("angles", known.angles))
                if answer.head.get("lit"):  # the same with a draft of its light, which takes longer
                    lit = {"do": "light", "message": {**message, "again": True}}
                    with contextlib.suppress(Denied):
                        self._start(("light", name), None, name, lit, self._play.views)

        message = {"kind": "view", "file": name, "version": version}
        self._start(("view", name), None, name, {"do": "view", "message": message}, self._play.views, viewed)

    async def _draw(self, message: Json) -> None:
        name, known = self._known(message)
        id, by = id_of(message), choice_of(message, "by", LIMITS_S.keys() - {"view", "light"})
        said = {"kind": "figures" if by == "figures" else "picture", "id": id, "file": name}
        said |= {"version": known.version, "by": by}
        job = {"do": by, "message": said, **wishes(message)}
        self._start((by, ""), id, name, job, self._play.quick if by == "network" else self._play.slow)

    async def _download(self, message: Json) -> None:
        name, known = self._known(message)
        id, kind = id_of(message), choice_of(message, "as", FILES)
        stem = Path(name).name.removesuffix("nsg") + ("png" if kind == "apng" else kind)

        def made(answer: Answer) -> None:
            key = self._play.store.put(stem, FILES[kind], answer.data)
            url = f"download?key={key}"
            self.tell({"kind": "ready", "id": id, "url": url, "name": stem, "bytes": len(answer.data)})

        if kind == "nsg":
            made(Answer(known.text.encode()))
            return
        job = {"do": "file", "as": kind, "message": {}, **wishes(message)}
        self._start(("file", str(id)), id, name, job, self._play.slow, made)

    async def _stop(self, message: Json) -> None:
        wanted = id_of(message)
        self._cancel(lambda slot, id, file: id == wanted)

    def _start(self, slot: Slot, id: Any, name: str, job: Json, pool: Pool, done: Took | None = None) -> None:
        """Start a job for a file, as the page has it; the one in its slot is cancelled.

        The page may know it by an ``id``; ``done`` is called with the answer before the page gets it.
        """
        known, root = self.open[name], self._play.folder.root
        job = {"params": {}, "frame": 0, "size": None, **job, "name": name, "text": known.text}
        for key, value in job["params"].items():  # a number of radians becomes a literal of the language
            if key in known.angles and isinstance(value, int | float) and not isinstance(value, bool):
                job["params"] = {**job["params"], key: f"{value!r}rad"}
        job["path"], job["root"] = str(known.path), None if root is None else str(root)
        others = (other for other in self.open.values() if other is not known and other.version)
        job["texts"] = {str(other.path.resolve()): other.text for other in others}
        if slot in self._jobs:
            self._jobs[slot][0].cancel()
        elif len(self._jobs) >= MOST_JOBS:
            raise Denied("too many drawings at the same time")
        task = asyncio.create_task(self._work(id, name, job, pool, done))
        self._jobs[slot] = task, id, name

        def ended(_: object) -> None:
            if task.cancelled() and id is not None:  # perhaps before it began
                self.tell({"kind": "cancelled", "id": id})
            if slot in self._jobs and self._jobs[slot][0] is task:
                del self._jobs[slot]

        task.add_done_callback(ended)

    def _cancel(self, wanted: Callable[[Slot, Any, str], bool]) -> None:
        """Cancel the jobs whose slot, id and file ``wanted`` is true of."""
        for slot, (task, id, file) in list(self._jobs.items()):
            if wanted(slot, id, file):
                task.cancel()

    async def _work(self, id: Any, file: str, job: Json, pool: Pool, done: Took | None) -> None:
        def said(share: float) -> None:
            self.tell({"kind": "progress", "id": id, "done": round(share, 4)})

        try:
            limit = LIMITS_S.get(job["do"], FILE_S)
            answer = await pool.run(job, limit, said if job["do"] == "file" else None)
        except JobFailed as error:
            if job["do"] == "light":
                return
            if job["do"] == "view":
                problem = {"code": "", "severity": "error", "message": str(error), "line": 1, "column": 1}
                self.tell({**job["message"], "view": None, "problems": [problem], "ms": None})
            else:
                self.tell({"kind": "error", "id": id, "file": file, "message": str(error)})
            return
        if done is not None:
            done(answer)
        if job["do"] != "file":
            self.tell(answer.data.decode())


_ANSWERS: Final[dict[str, Callable[[Live, Json], Coroutine[Any, Any, None]]]] = {
    "open": Live._open,
    "edit": Live._edit,
    "save": Live._save,
    "discard": Live._discard,
    "close": Live._close,
    "rename": Live._rename,
    "draw": Live._draw,
    "download": Live._download,
    "cancel": Live._stop,
}
