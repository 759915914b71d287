"""A worker on a host of its own, a network namespace with no folder of this one's, at the end of a wire."""

from __future__ import annotations

import os
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.output.animate import Progress
from tests.output.machines import started

pytestmark = pytest.mark.slow
HERE, THERE = "10.213.77.1", "10.213.77.2"
SCENE = "canvas(24, 16); param k = 0 in 0..1; sphere { scale(0.6); } torus { rotate(0.2turn * k); }"


def ip(words: str, *more: str) -> None:
    done = subprocess.run(["ip", *words.split(), *more], capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(done.stderr)


@pytest.fixture
def wire() -> Iterator[str]:
    """The near end of a wire to a host of the same name."""
    name = f"nsg{os.getpid()}"
    try:
        ip(f"netns add {name}")
    except OSError as error:  # there is no such command, or it is not allowed
        pytest.skip(f"no hosts can be made here: {error}")
    try:
        ip(f"link add {name} type veth peer name far netns {name}")
    except OSError:
        ip(f"netns delete {name}")
        raise
    try:
        ip(f"address add {HERE}/24 dev {name}")
        ip(f"link set {name} up")
        for words in (f"address add {THERE}/24 dev far", "link set far up", "link set lo up"):
            ip(f"-n {name} {words}")
        yield name
    finally:
        ip(f"link delete {name}")  # with its other end, which would take its time
        ip(f"netns delete {name}")


def pulled(wire: str, seconds: float) -> Callable[[Progress], None]:
    """A report that takes the wire off for some time, when a third is done."""
    pulls = [True]

    def back() -> None:
        time.sleep(seconds)
        ip(f"link set {wire} up")

    def report(now: Progress) -> None:
        if now.done >= now.total / 3 and pulls:
            pulls.pop()
            ip(f"link set {wire} down")
            threading.Thread(target=back).start()

    return report


@pytest.mark.parametrize("seconds", [0, 5])
def test_another_host_draws_the_same(tmp_path: Path, wire: str, seconds: float) -> None:
    """Also if the wire is pulled on the way, for so many seconds."""
    (tmp_path / "a.nsg").write_text(SCENE)
    hidden = ["unshare", "-m", "sh", "-c", 'mount -t tmpfs none "$0" && exec "$@"', str(tmp_path)]
    within = ["ip", "netns", "exec", wire, *hidden]
    asked = {"random": ["k"], "count": 300 if seconds else 30}
    one = nsg.render_many(tmp_path / "a.nsg", tmp_path / "one", **asked)
    with started(tmp_path, 1, hosts=(HERE, THERE), within=within) as (address, _):
        begun = time.monotonic()
        progress = pulled(wire, seconds) if seconds else lambda now: None
        two = nsg.render_many(
            tmp_path / "a.nsg", tmp_path / "two", **asked, cluster=address, progress=progress
        )
        assert time.monotonic() - begun >= seconds
    assert two.made.drawn == asked["count"]
    for path in one.made.files:
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
