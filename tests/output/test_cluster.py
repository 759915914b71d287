"""Frames on the workers of a dask cluster: a scheduler and two workers on loopback, and what befalls them."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from scenelang.drawing.how import RenderError
from scenelang.output import painting as ours
from scenelang.output import workers
from scenelang.output.animate import Progress
from scenelang.output.workers import GivenUp, Link, by_workers
from tests.output.conftest import started
from tests.output.scenes import DARK, HEAD

distributed = pytest.importorskip("distributed")
MOVING = HEAD + DARK + "canvas(24, 16); sphere { scale(0.6); } torus { rotate(0.2turn * u); }"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "a.nsg"
    path.write_text(MOVING)
    return path


def same(one: list[Path], two: list[Path]) -> bool:
    return [path.read_bytes() for path in one] == [path.read_bytes() for path in two]


def test_workers_draw_the_same_bytes(scene: Path, tmp_path: Path, address: str) -> None:
    one = nsg.animate(scene, tmp_path / "one-%d.png")
    two = nsg.animate(scene, tmp_path / "two-%d.png", cluster=address)
    assert (two.jobs, two.drawn) == (2, 6)
    assert same(one.files, two.files)
    nsg.animate(scene, tmp_path / "one.gif")
    nsg.animate(scene, tmp_path / "two.gif", cluster=address)
    assert same([tmp_path / "one.gif"], [tmp_path / "two.gif"])


def test_outputs_and_bad_rows(tmp_path: Path, address: str) -> None:
    path = tmp_path / "a.nsg"
    path.write_text(SOLIDS)
    asked: dict[str, Any] = {"values": [{"x": 0.1}, {"x": 9}, {"x": -0.3}], "outputs": ("depth", "object")}
    one = nsg.render_many(path, tmp_path / "one", **asked)
    two = nsg.render_many(path, tmp_path / "two", **asked, cluster=address)
    assert [line.error[:5] for line in two.lines] == ["", "E0309", ""]
    assert len(one.made.files) == 6
    assert same(one.made.files, two.made.files)


SOLIDS = "canvas(24, 16); param x = 0 in -0.5..0.5; sphere { scale(0.4); translate(x, 0, 0); } torus;"


def test_elements_travel_with_their_programs(tmp_path: Path, address: str) -> None:
    """No file of theirs is there any more when they are drawn."""
    here, away = Path(__file__).parents[2] / "examples", tmp_path / "away"
    shutil.copytree(
        here, away, ignore=lambda _, names: {n for n in names if "fox" not in n and "orig" not in n}
    )
    program = nsg.compile(nsg.load(away / "fox.nsg", size=(48, 48)))
    shutil.rmtree(away)
    helper = ours.Cluster(address)
    try:
        helper.submit(program, ours.Errand(str(tmp_path / "fox.png"), "numpy", 1))
        while helper.waiting:
            helper.take()
    finally:
        helper.close()
    assert (tmp_path / "fox.png").read_bytes() == nsg.render(program).encode()


def test_small_frames_travel_together(tmp_path: Path, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.nsg"
    path.write_text("canvas(8, 8); param k = 0.5 in 0..1; star { scale(0.9); rotate(90deg * k); }")
    sent: list[int] = []
    send = Link.send

    def counted(self: Link, function: Any, batch: Any) -> Any:
        sent.append(len(batch))
        return send(self, function, batch)

    monkeypatch.setattr(Link, "send", counted)
    made = nsg.render_many(path, tmp_path / "out", random=["k"], count=60, cluster=address)
    assert sum(sent) == made.made.drawn == 60
    assert max(sent) > 1
    assert max(sent) <= ours.MOST_BATCH


def at_half(act: Callable[[], object]) -> Callable[[Progress], None]:
    """A report that acts once, when half of the frames are done."""
    acts = [act]

    def report(now: Progress) -> None:
        if now.done >= now.total / 2 and acts:
            acts.pop()()

    return report


LARGE = "canvas(128, 128); param k = 0.5 in 0..1; smooth { star { twirl(k); } square { scale(0.5); } }"


@pytest.mark.slow
def test_a_worker_that_is_killed(tmp_path: Path) -> None:
    path = tmp_path / "a.nsg"
    path.write_text(LARGE)
    asked: dict[str, Any] = {"grid": {"k": "../16"}}
    with started(tmp_path, 2) as (address, _):
        client = distributed.Client(address, set_as_default=False)
        first, *_ = client.run(os.getpid).values()
        kill = at_half(lambda: os.kill(first, signal.SIGKILL))
        made = nsg.render_many(path, tmp_path / "out", **asked, cluster=address, progress=kill)
        assert len(client.scheduler_info()["workers"]) == 1
        client.close()
    alone = nsg.render_many(path, tmp_path / "alone", **asked)
    assert made.made.drawn == 16
    assert same(alone.made.files, made.made.files)


@pytest.mark.slow
def test_a_scheduler_that_goes_away(tmp_path: Path) -> None:
    """What is done stays; the same call, without a cluster this time, draws the rest."""
    path = tmp_path / "a.nsg"
    path.write_text(LARGE)
    asked: dict[str, Any] = {"grid": {"k": "../16"}}
    with (
        started(tmp_path, 1) as (address, (scheduler, *_)),
        pytest.raises(nsg.RenderError, match="is gone; the same command goes on"),
    ):
        nsg.render_many(path, tmp_path / "out", **asked, cluster=address, progress=at_half(scheduler.kill))
    made = nsg.render_many(path, tmp_path / "out", **asked)
    assert 8 <= made.made.resumed < 16
    alone = nsg.render_many(path, tmp_path / "alone", **asked)
    assert same(alone.made.files, made.made.files)


def test_a_frame_that_cannot_be_drawn(scene: Path, tmp_path: Path, address: str) -> None:
    """What is wrong on a worker is told here."""
    program = nsg.compile(nsg.load(scene))
    helper = ours.Cluster(address)
    try:
        helper.submit(program, ours.Errand(str(tmp_path / "a.png"), "cuda", 1))
        assert helper.waiting == 1
        with pytest.raises(nsg.RenderError, match="CUDA is asked for"):
            helper.take()
    finally:
        helper.close()


def test_the_reference_stays_here(scene: Path, tmp_path: Path) -> None:
    with pytest.raises(nsg.RenderError, match="draws by the network"):
        nsg.animate(scene, tmp_path / "%d.png", cluster="local", backend="reference")


@pytest.mark.slow
def test_workers_of_this_machine(scene: Path, tmp_path: Path) -> None:
    """In a process of its own, as dask starts its workers by running the main module again."""
    scene.write_text(HEAD + DARK + "canvas(24, 16); star { scale(0.6); rotate(0.2turn * u); }")
    command = [sys.executable, "-m", "scenelang", "render", str(scene), "-o", str(tmp_path / "f-%d.png")]
    done = subprocess.run([*command, "--cluster", "local"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    one = nsg.animate(scene, tmp_path / "one-%d.png")
    assert same(one.files, [tmp_path / f"f-{at}.png" for at in range(6)])


# ---------------------------------------------------------------- who is a worker


def test_workers_that_would_give_something_else(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their library, weights or code differ, or a package that this work needs besides."""
    compare, others = workers.differences, ("scipy", "no-such-library")
    for what in ("numpy", "weights of shapes2d", "scenelang's code", "no-such-library"):
        monkeypatch.setattr(
            workers, "differences", lambda a, b, what=what: compare({**a, what: "another"}, b)
        )
        with pytest.raises(RenderError, match=rf"worker tcp\S+ has {what} \S+, where another is here"):
            Link(address, others)
    here = workers.fingerprint()
    assert here.keys().isdisjoint(others)
    assert workers.fingerprint(others)["no-such-library"] == "none"
    assert compare(here, here) == ([], [])
    assert compare(here, {**here, "python": "3.9"}) == ([], [f"python 3.9, where {here['python']} is here"])


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "WAIT_S", 0.5)
    with pytest.raises(RenderError, match=r"no scheduler with workers at `tcp://127\.0\.0\.1:9`"):
        Link("tcp://127.0.0.1:9")


def test_each_item_has_a_result_or_an_error_of_its_own(address: str) -> None:
    """More of them than are under way at once; one is no number."""
    items = [(word, word) for word in ["4", "9", "16", "x", "25", "36", "49", "64", "81", "100"]]
    found, wrong = {}, []
    for word, result in by_workers(address, float, items):
        try:
            found[word] = result()
        except ValueError:
            wrong.append(word)
    assert found == {word: float(word) for word, _ in items if word != "x"}
    assert wrong == ["x"]


@pytest.mark.slow
def test_what_ends_workers_is_given_up(tmp_path: Path) -> None:
    with started(tmp_path, 4) as (address, _):
        for _, result in by_workers(address, os._exit, [("bad", 3)]):
            with pytest.raises(GivenUp, match="4 workers ended over it"):
                result()
