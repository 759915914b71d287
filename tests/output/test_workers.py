"""Work on a dask cluster on loopback: the same results as without it, whatever befalls its workers."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

import scenelang as nsg
from scenelang.assets.element_file import load_element_file
from scenelang.drawing.how import RenderError
from scenelang.inverse import learn as learning
from scenelang.inverse.sandbox import LIBRARIES
from scenelang.output import painting as ours
from scenelang.output import workers
from scenelang.output.animate import Progress
from scenelang.output.workers import Connection, GivenUp, by_workers
from tests.inverse.fewer import settle_by_fewer
from tests.output.scenes import DARK, HEAD


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A scheduler with two workers."""
    with started(tmp_path_factory.mktemp("cluster"), 2) as (at, _):
        yield at


@contextlib.contextmanager
def started(
    folder: Path, workers: int, **variables: str
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler's address, its process and those of workers, without who would start them again.

    Variables of the environment that name certificates make a scheduler that takes nothing else.
    """
    file = folder / "scheduler.json"
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet["env"] = {**os.environ, **variables}
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0"]
    command += ["--host", "127.0.0.1"]
    command += ["--protocol", "tls"] if variables else []
    every = [subprocess.Popen([*command, "--no-dashboard", "--scheduler-file", str(file)], **quiet)]
    try:
        deadline = time.monotonic() + 60
        while not file.exists() or not file.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--host", "127.0.0.1"]
        command += ["--nthreads", "1", "--no-dashboard", "--no-nanny", "--local-directory", str(folder)]
        every += [subprocess.Popen(command, **quiet) for _ in range(workers)]
        if not variables:
            with distributed.Client(address, set_as_default=False) as client:
                client.wait_for_workers(workers, timeout=60)
        yield address, every
    finally:
        for process in every:
            process.kill()
            process.wait()


distributed = pytest.importorskip("distributed")
MOVING = HEAD + DARK + "canvas(24, 16); sphere { scale(0.6); } torus { rotate(0.2turn * u); }"


def write(folder: Path, text: str) -> Path:
    (folder / "a.nsg").write_text(text)
    return folder / "a.nsg"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write(tmp_path, MOVING)


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
    path = write(tmp_path, SOLIDS)
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


def at_half(act: Callable[[], object]) -> Callable[[Progress], None]:
    """A report that acts once, when half of the frames are done."""
    acts = [act]

    def report(now: Progress) -> None:
        if now.done >= now.total / 2 and acts:
            acts.pop()()

    return report


LARGE = "canvas(256, 256); param k = 0.5 in 0..1; smooth { star { twirl(k); } square { scale(0.5); } }"


@pytest.mark.slow
def test_a_worker_that_is_killed(tmp_path: Path) -> None:
    path, grid = write(tmp_path, LARGE), {"k": "../16"}
    with started(tmp_path, 2) as (address, _):
        client = distributed.Client(address, set_as_default=False)
        first, *_ = client.run(os.getpid).values()
        kill = at_half(lambda: os.kill(first, signal.SIGKILL))
        made = nsg.render_many(path, tmp_path / "out", grid=grid, cluster=address, progress=kill)
        assert len(client.scheduler_info()["workers"]) == 1
        client.close()
    alone = nsg.render_many(path, tmp_path / "alone", grid=grid)
    assert made.made.drawn == 16
    assert same(alone.made.files, made.made.files)


@pytest.mark.slow
def test_a_scheduler_that_goes_away(tmp_path: Path) -> None:
    """What is done stays; the same call, without a cluster this time, draws the rest."""
    path, grid = write(tmp_path, LARGE), {"k": "../16"}
    with (
        started(tmp_path, 1) as (address, (scheduler, *_)),
        pytest.raises(nsg.RenderError, match="is gone; the same command goes on"),
    ):
        nsg.render_many(path, tmp_path / "out", grid=grid, cluster=address, progress=at_half(scheduler.kill))
    made = nsg.render_many(path, tmp_path / "out", grid=grid)
    assert 8 <= made.made.resumed < 16
    alone = nsg.render_many(path, tmp_path / "alone", grid=grid)
    assert same(alone.made.files, made.made.files)


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


def test_workers_that_would_give_something_else(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their library, weights or code differ, or a package that this work needs besides."""
    compare, others = workers.differences, ("scipy", "no-such-library")
    for what in ("numpy", "weights of shapes2d", "scenelang's code", "no-such-library"):
        monkeypatch.setattr(
            workers, "differences", lambda a, b, what=what: compare({**a, what: "another"}, b)
        )
        with pytest.raises(RenderError, match=rf"worker tcp\S+ has {what} \S+, where another is here"):
            Connection(address, others)
    here = workers.fingerprint()
    assert here.keys().isdisjoint(others)
    assert workers.fingerprint(others)["no-such-library"] == "none"
    assert compare(here, here) == ([], [])
    assert compare(here, {**here, "python": "3.9"}) == ([], [f"python 3.9, where {here['python']} is here"])


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "WAIT_S", 0.5)
    with pytest.raises(RenderError, match=r"no scheduler with workers at `tcp://127\.0\.0\.1:9`"):
        Connection("tcp://127.0.0.1:9")


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


SCENE = "canvas(16, 16); animate(fps = 2, seconds = 1); star { rotate(90deg * u); }"


def certificate(folder: Path, name: str) -> dict[str, str]:
    """A certificate that signs itself, as dask's variables name it."""
    key, made = (folder / f"{name}.{kind}.pem" for kind in ("key", "cert"))
    command = [
        *["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj"],
        f"/CN={name}",
    ]
    done = subprocess.run([*command, "-keyout", key, "-out", made], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    tls = "DASK_DISTRIBUTED__COMM__TLS__"
    files = {f"{tls}CA_FILE": str(made)}
    for role in ("SCHEDULER", "WORKER", "CLIENT"):
        files |= {f"{tls}{role}__KEY": str(key), f"{tls}{role}__CERT": str(made)}
    return {**files, "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True"}


@pytest.mark.skipif(not shutil.which("openssl"), reason="openssl makes the certificates")
def test_only_who_has_the_certificate_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import dask

    write(tmp_path, SCENE)
    variables, others = certificate(tmp_path, "ours"), certificate(tmp_path, "others")
    with started(tmp_path, 1, **variables) as (address, _):
        assert address.startswith("tls://127.0.0.1:")
        command = [sys.executable, "-m", "scenelang", "render", str(tmp_path / "a.nsg"), "--cluster", address]

        def ended(out: str, **more: str) -> tuple[int, str]:
            done = subprocess.run(
                [*command, "-o", str(tmp_path / out)],
                env={**os.environ, **more},
                capture_output=True,
                text=True,
                timeout=60,  # a connection that fails does not hold up the end
                check=False,
            )
            return done.returncode, done.stderr

        assert ended("far-%d.png", **variables)[0] == 0
        code, said = ended("none-%d.png")
        assert (code, said.count("\n")) == (2, 1)
        assert said.startswith(f"Error: no scheduler with workers at `{address}`: TLS expects")
        near = nsg.animate(tmp_path / "a.nsg", tmp_path / "near-%d.png").files
        assert len(near) == 2
        for path in near:
            assert path.read_bytes() == (tmp_path / path.name.replace("near", "far")).read_bytes()

        monkeypatch.setattr(workers, "WAIT_S", 1.0)
        plain = address.replace("tls", "tcp")
        strange = {name.removeprefix("DASK_").lower().replace("__", "."): at for name, at in others.items()}
        for where, config in ((address, {}), (plain, {}), (address, strange)):
            with dask.config.set(config), pytest.raises(nsg.RenderError) as caught:
                Connection(where)
            assert str(caught.value).startswith(f"no scheduler with workers at `{where}`: ")
            assert "\n" not in str(caught.value)


FILES = ["ball.ply", "star.svg", "tent.obj"]
TENT = "mtllib tent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl tex\n"
TENT += "f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/2 3/3 4/1\nf 1/1 4/2 3/3\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The first of `FILES` takes longest; the last has a texture."""
    pytest.importorskip("igl")
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(3).export("ball.ply")
    Path("star.svg").write_text('<svg><path d="M50 0 L79 91 2 35 98 35 21 91Z"/></svg>')
    Path("tent.obj").write_text(TENT)
    Path("tent.mtl").write_text("newmtl tex\nmap_Kd skin.png\n")
    shades = np.linspace(0, 255, 16 * 16 * 3).reshape(16, 16, 3).astype(np.uint8)
    Image.fromarray(shades).save("skin.png")
    return tmp_path


def test_the_file_is_the_one_without_workers(
    folder: Path, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[str] = []
    nsg.learn(FILES, "one.safetensors", steps=2)
    nsg.learn(FILES, "two.safetensors", steps=2, cluster=address, say=heard.append)
    assert Path("one.safetensors").read_bytes() == Path("two.safetensors").read_bytes()
    assert load_element_file("two.safetensors").materials.keys() == {"tent"}
    said = [line.partition(":")[0] for line in heard if not line.startswith(" ")]
    assert said.index("star") < said.index("ball")
    assert [name for name, last in zip(said, [None, *said], strict=False) if name != last] in (
        ["star", "ball", "tent"],
        ["star", "tent", "ball"],
    )
    whole = Path("two.safetensors").read_bytes()
    monkeypatch.setattr(Connection, "send", None)
    heard.clear()
    nsg.learn(FILES, "two.safetensors", steps=2, cluster=address, say=heard.append)
    assert heard == [f"{name}: made before of this file" for name in ("ball", "star", "tent")]
    assert Path("two.safetensors").read_bytes() == whole


def backwards(
    address: str, function: Callable[..., Any], items: Iterable[tuple[int, Any]], libraries: tuple[str, ...]
) -> Iterator[tuple[int, Callable[[], Any]]]:
    """`by_workers` of one that is done with the last first, and ends over a file called ``fatal``."""

    def lost() -> None:
        raise GivenUp("given up")

    for index, (request, data) in reversed([*items]):
        yield index, lost if request["name"] == "fatal" else partial(function, (request, data))


def test_who_is_first_has_no_say(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part of one file has the name of another, which comes later and so takes its place."""
    settle_by_fewer(monkeypatch)
    scene = trimesh.Scene()
    for name, place in (("body", 0), ("roof", 5)):
        box = trimesh.creation.box((1, 2, 3 + place))
        scene.add_geometry(box.apply_translation((place, 0, 0)), node_name=name, geom_name=name)
    Path("car.glb").write_bytes(scene.export(file_type="glb"))
    trimesh.creation.icosphere(1).export("car_roof.ply")
    Path("fatal.svg").write_bytes(Path("star.svg").read_bytes())
    files = ["car.glb", "car_roof.ply", "fatal.svg", "star.svg"]
    nsg.learn([name for name in files if "fatal" not in name], "one.safetensors", steps=1, parts=True)
    found = load_element_file("one.safetensors").geometries
    assert found.keys() == {"car", "car_body", "car_roof", "star"}
    assert found["car_roof"].about["original"] == "car_roof.ply"
    monkeypatch.setattr(learning, "by_workers", backwards)
    with pytest.raises(nsg.FitError, match=r"^fatal\.svg: given up$"):
        nsg.learn(files, "two.safetensors", steps=1, parts=True, cluster="somewhere")
    assert Path("one.safetensors").read_bytes() == Path("two.safetensors").read_bytes()


def test_libraries_of_learning_are_compared(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
    needed = {re.split("[><=]", line)[0] for line in project["optional-dependencies"]["learn"]}
    assert needed | {"pillow"} == {*LIBRARIES}
    asked: list[Any] = []
    monkeypatch.setattr(learning, "by_workers", lambda *given: iter(asked.append(given[3]) or ()))
    learning.learn_files(["star.svg"], "z.safetensors", cluster="tcp://there")
    assert asked == [LIBRARIES]
