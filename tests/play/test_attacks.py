"""What nobody should send: the page goes on answering, and so do others."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed

from scenelang.web.folder import Folder, Journal
from scenelang.web.live import Live, Play
from tests.play.client import Page, Server
from tests.play.conftest import SQUARE

# Loops that end at a limit of the language after seconds, and what has no end but limits.
BOMBS = {
    "loop": "for (i in 0..1000000000) { square; }",
    "calls": "fn f(x) = f(x) + f(x); square { scale(f(1)); }",
    "modules": "module m() { m(); m(); } m();",
    "objects": "for (i in 0..99999) { for (j in 0..99999) { square; } }",
    "canvas": "canvas(100000, 100000); square;",
}


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
    page.draw(4, "b.nsg")
    page.until("picture", id=4)


def test_halves_of_characters_and_large_texts_are_refused(page: Page) -> None:
    page.open("b.nsg")
    for text in ("\ud800", "x" * 10_000_001):
        page.say("edit", file="b.nsg", version=1, text=text)
        page.until("error", file="b.nsg")


def test_who_does_not_listen_is_given_up() -> None:
    """What is said to a page that reads nothing is bounded; it is let go, and others are not."""

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


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_bomb_keeps_nobody_waiting(server: Server, page: Page, bomb: str) -> None:
    with server.page() as other:
        for one in (page, other):
            one.open("b.nsg")
        page.say("edit", file="b.nsg", version=1, text=BOMBS[bomb])
        page.draw(1, "b.nsg", size=None)
        page.draw(2, "b.nsg", by="reference", size=None)
        other.draw(3, "b.nsg")
        other.until("picture", id=3)
        # a newer text takes the place of the bomb's, whatever that was doing
        page.say("edit", file="b.nsg", version=2, text=SQUARE)
        page.draw(4, "b.nsg")
        page.until("picture", id=4, version=2)
        page.say("edit", file="b.nsg", version=3, text=BOMBS[bomb])
        assert page.until("view", version=3)["view"] is None
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
