"""Frames on the workers of a dask cluster: a scheduler and two workers on loopback, and what befalls them."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from scenelang.output import painting as ours
from scenelang.output.animate import Progress
from scenelang.output.workers import Link
from tests.output.machines import started
from tests.output.scenes import DARK, HEAD

distributed = pytest.importorskip("distributed")
MOVING = HEAD + DARK + "canvas(24, 16); sphere { scale(0.6); } torus { rotate(0.2turn * u); }"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with started(tmp_path_factory.mktemp("cluster"), 2) as (found, _):
        yield found


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


def test_an_evaluation_has_the_same_figures(address: str) -> None:
    from lab.evaluate import evaluate_set
    from scenelang.drawing.neural.load import load_model

    model, timed = load_model("solids3d"), {"seconds"}
    one, two = (evaluate_set(model, "staged", 4, 5, side=16, cluster=where) for where in (None, address))
    assert {k: v for k, v in one[0].items() if k not in timed} == {
        k: v for k, v in two[0].items() if k not in timed
    }
    assert one[1] == two[1]
