"""Drawing frames on the workers of a dask cluster.

Programs go out as bytes, with the elements and textures that they draw, and files come back as bytes: no file
system is shared. Dask sends them with the names of functions below by pickle, so that whoever reaches a
scheduler runs code on its workers; of a scene nothing but our own formats is sent.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import platform
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from scenelang.animation.painting import Errand
from scenelang.animation.store import put_frame
from scenelang.backend.options import RenderError, usable_cores
from scenelang.models.manifest import ROOT as MODELS
from scenelang.program.program import Program, program_bytes

if TYPE_CHECKING:
    from distributed import Client, Future

LOCAL: Final = "local"
AHEAD: Final = 3  # batches under way for each worker
BATCH_S: Final = 0.25  # of drawing in a batch, beside which a task's own milliseconds are little
MOST_BATCH: Final = 64
MOST_BYTES: Final = 4 << 20  # of Programs in a batch, where elements make them large
LOGGED: Final = "distributed.admin.low-level-log-length"  # messages that dask keeps, and what is in them
WAIT_S: Final = 30.0  # for a scheduler to answer, and for workers
_HARMLESS: Final = ("python", "processor")
"""What differs without a difference in pixels, or with one of 1/255 at most."""
_NEEDED: Final = ("distributed", "numpy", "scenelang", "torch")
T = TypeVar("T")
R = TypeVar("R")
_local = threading.local()


class Link:
    """A connection to workers that give the pixels of this machine.

    Args:
        address: of the scheduler, such as ``tcp://host:8786``, or ``"local"``: a worker for each core of this
            machine, which nobody else reaches; ``"local:8787"`` has dask's dashboard on that port.

    Raises:
        RenderError: there is no dask, no scheduler or no worker, or a worker would draw other pixels.
    """

    def __init__(self, address: str) -> None:
        try:
            import dask
            import distributed
        except ModuleNotFoundError:
            raise RenderError("a cluster needs dask: pip install 'scenelang[dask]'") from None
        for name in ("distributed", "distributed.client"):  # what matters of what they say is raised
            logging.getLogger(name).setLevel(logging.CRITICAL)
        dask.config.set({LOGGED: 1})  # else what was sent stays in memory
        self.address = address
        self._own: _Local | None = None
        try:
            if address.partition(":")[0] == LOCAL:
                self._own = _Local(address)
            where = self._own.address if self._own else address
            self._client: Client = distributed.Client(where, timeout=WAIT_S, set_as_default=False)
            self._client.wait_for_workers(self._own.count if self._own else 1, timeout=WAIT_S)
        except (OSError, TimeoutError, TypeError, ValueError) as error:  # TypeError: no certificates
            self.close()
            raise RenderError(f"no scheduler with workers at `{address}`: {_told(error)}") from None
        try:
            self._first = self._compare()
        except BaseException:
            self.close()
            raise
        self._done = distributed.as_completed(loop=self._client.loop)

    @property
    def count(self) -> int:
        """Workers that there were a few seconds ago."""
        known: int = self._client._scheduler_identity.get("n_workers", 0)  # asking would wait for an answer
        return known or self._first

    @property
    def ready(self) -> bool:
        """Whether `next` need not wait."""
        return bool(self._done.has_ready())

    def send(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Have a function of ours called by a worker, after it has compared fingerprints."""
        future = self._client.submit(_checked, fingerprint(), function, *arguments, pure=False)
        self._done.add(future)
        return future

    def next(self) -> tuple[Future[Any], Any]:
        """What was sent and is done next, and what it gave; raises what it raised.

        Raises:
            RenderError: several workers ended over it, or the scheduler is gone.
        """
        from distributed.comm.core import CommClosedError
        from distributed.scheduler import KilledWorker

        future = next(self._done)
        try:
            return future, future.result()
        except KilledWorker as error:
            raise RenderError(f"given up: {error.allowed_failures + 1} workers ended over it") from None
        except (CancelledError, CommClosedError, TimeoutError):
            raise RenderError(
                f"the scheduler at `{self.address}` is gone; the same command goes on with what is left"
            ) from None

    def close(self) -> None:
        """Call off what is under way; workers of this machine end."""
        with contextlib.suppress(Exception):  # there may be none yet, or none any more
            self._client.close(timeout=2)
        if self._own is not None:
            self._own.close()

    def _compare(self) -> int:
        """How many workers there are; raises `RenderError` where one would draw other pixels."""
        found = self._client.run(look, on_error="return")
        for address, theirs in found.items():
            if not isinstance(theirs, dict):
                raise RenderError(f"worker {address} cannot run scenelang: {_told(theirs)}")
            fatal, harmless = differences(fingerprint(), theirs)
            if fatal:
                raise RenderError(f"worker {address} has {fatal[0]}")
            for fact in harmless:
                logging.getLogger("scenelang").warning("worker %s has %s", address, fact)
        return len(found)


class Cluster:
    """The workers of a scheduler that draw frames, as `Helpers`; arguments and errors are those of `Link`."""

    def __init__(self, address: str) -> None:
        self._link = Link(address)
        self.batches = 0  # sent so far
        self._batch: list[tuple[bytes, Errand]] = []
        self._each_s = BATCH_S  # a frame, as far as is known
        self._under_way: dict[Future[Any], list[Errand]] = {}

    @property
    def count(self) -> int:
        """How many there are."""
        return self._link.count

    @property
    def waiting(self) -> int:
        """Frames that are asked for and not known to be done."""
        while self._under_way and self._link.ready:
            self._receive()
        return len(self._batch) + sum(map(len, self._under_way.values()))

    def submit(self, program: Program, errand: Errand) -> None:
        """Have a Program drawn to files; waits while many are under way. Raises as `take`."""
        self._batch.append((program_bytes(program), errand))
        large = sum(len(data) for data, _ in self._batch) > MOST_BYTES
        if large or len(self._batch) >= max(1, min(MOST_BATCH, int(BATCH_S / self._each_s))):
            while len(self._under_way) >= AHEAD * self.count:
                self._receive()
            self._send()

    def take(self) -> None:
        """Send what waits for others to travel with, and write what comes back next.

        Raises:
            RenderError: it cannot be drawn, several workers ended over it, or the scheduler is gone.
            OSError: a file cannot be written.
        """
        self._send()
        self._receive()

    def close(self) -> None:
        """Call off what is under way."""
        self._link.close()

    def _receive(self) -> None:
        future, (seconds, found) = self._link.next()
        errands = self._under_way.pop(future)
        self._each_s = 0.5 * (self._each_s + seconds / len(errands))
        for errand, files in zip(errands, found, strict=True):
            folder = Path(errand.file).parent
            put_frame({folder / name: data for name, data in files.items()})

    def _send(self) -> None:
        if self._batch:
            self._under_way[self._link.send(draw_batch, self._batch)] = [errand for _, errand in self._batch]
            self._batch, self.batches = [], self.batches + 1


def by_workers(address: str, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
    """A function of ours on each item, by workers, in whatever order that is done; raises as `Link`."""
    link, waiting = Link(address), 0
    try:
        for item in items:
            if waiting >= AHEAD * link.count:
                yield link.next()[1]
                waiting -= 1
            link.send(function, item)
            waiting += 1
        for _ in range(waiting):
            yield link.next()[1]
    finally:
        link.close()


class _Local:
    """A scheduler in this process and a worker for each core, which listen to this machine alone.

    Workers are plain processes: those that dask starts by itself run an embedder's main module again.
    """

    def __init__(self, address: str) -> None:
        from distributed import LocalCluster

        port = address.partition(":")[2]
        self._cluster = LocalCluster(
            n_workers=0,
            host="127.0.0.1",
            dashboard_address=f"127.0.0.1:{int(port)}" if port else None,
            silence_logs=logging.CRITICAL,
        )
        self.address: str = self._cluster.scheduler_address
        command = [sys.executable, "-m", "distributed.cli.dask_worker", self.address, "--host", "127.0.0.1"]
        command += ["--nthreads", "1", "--dashboard-address", "127.0.0.1:0", "--death-timeout", "10"]
        quiet = subprocess.DEVNULL
        self.count = usable_cores()
        self._workers = [
            subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True)
            for _ in range(self.count)
        ]

    def close(self) -> None:
        """End all of it."""
        for worker in self._workers:
            worker.terminate()
        for worker in self._workers:
            worker.wait()
        self._cluster.close()


def _told(error: object) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


# ---------------------------------------------------------------- what runs on workers


def _checked(ours: dict[str, str], function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function where the fingerprint of who asks is that of this machine."""
    fatal, _ = differences(ours, fingerprint())
    if fatal:
        raise RenderError(f"a worker has {fatal[0]}")
    return function(*arguments)


def draw_batch(batch: Sequence[tuple[bytes, Errand]]) -> tuple[float, list[dict[str, bytes]]]:
    """Draw Programs on this machine: the processor's seconds, and the files of each by their names.

    Args:
        batch: bytes of Programs, and what is asked of them.

    Raises:
        RenderError: one cannot be drawn.
    """
    from scenelang.renderers.draw import Kept

    kept = _local.__dict__.setdefault("kept", Kept())
    started = time.process_time()  # others on this machine do not make batches smaller
    found = [
        {file.name: data for file, data in errand.run(program, kept).items()} for program, errand in batch
    ]
    return time.process_time() - started, found


@cache
def fingerprint() -> dict[str, str]:
    """What decides pixels on this machine: versions, digests of the code and of each model's weights."""
    found = {"python": platform.python_version(), "processor": platform.machine()}
    for name in _NEEDED:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    package = MODELS.parent
    code = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        code.update(file.relative_to(package).as_posix().encode() + file.read_bytes())
    found["scenelang's code"] = code.hexdigest()[:12]
    for weights in sorted(MODELS.glob("*/weights.safetensors")):
        found[f"weights of {weights.parent.name}"] = hashlib.sha256(weights.read_bytes()).hexdigest()[:12]
    return found


def look() -> dict[str, str]:
    """The fingerprint of the machine where it is called."""
    return fingerprint()


def differences(ours: dict[str, str], theirs: dict[str, str]) -> tuple[list[str], list[str]]:
    """What a worker has otherwise, in words: what changes pixels, and what hardly does."""
    found: tuple[list[str], list[str]] = [], []
    for name in sorted(ours.keys() | theirs.keys()):
        here, there = ours.get(name, "none"), theirs.get(name, "none")
        if here != there:
            found[name in _HARMLESS].append(f"{name} {there}, where {here} is here")
    return found
