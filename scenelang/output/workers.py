"""Workers of a dask cluster: a connection to them, and a check that they give the results of this machine.

Dask sends functions by name, and their arguments and results by pickle, so that anyone who reaches a
scheduler can run code on its workers. We send only bytes of files and plain data.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Final, TypeVar

from scenelang.compiler.manifest import ROOT as MODELS
from scenelang.drawing.how import RenderError, usable_cores

if TYPE_CHECKING:
    from distributed import Client, Future

LOCAL: Final = "local"
AHEAD: Final = 3  # pending tasks of each worker
LOGGED: Final = "distributed.admin.low-level-log-length"  # messages that dask keeps, with their contents
_LARGE: Final = "distributed.admin.large-graph-warning-threshold"  # bytes from which it warns
WAIT_S: Final = 30.0  # longest wait for a scheduler to answer, and for workers
_END_S: Final = 2.0  # longest wait for workers of this machine to end by themselves
_HARMLESS: Final = ("python", "processor")  # their differences change pixels by 1/255 at most
_NEEDED: Final = ("distributed", "numpy", "scenelang", "torch")
K = TypeVar("K")
T = TypeVar("T")
R = TypeVar("R")


class GivenUp(RenderError):
    """Several workers ended over one task, one after another."""


class Connection:
    """Connection to workers whose results are those of this machine; raises `RenderError` for any failure.

    The address is a scheduler's, or ``"local"``, a worker for each core here, ``"local:8787"`` with a
    dashboard. Versions of ``libraries`` must agree, besides those that draw.
    """

    def __init__(self, address: str, libraries: tuple[str, ...] = ()) -> None:
        try:
            import dask
            import distributed
        except ModuleNotFoundError:
            raise RenderError("a cluster needs dask: pip install 'scenelang[dask]'") from None
        for name in ("distributed", "distributed.client"):  # important messages are raised as errors
            logging.getLogger(name).setLevel(logging.CRITICAL)
        dask.config.set({LOGGED: 1, _LARGE: 1 << 40})  # else arguments stay in memory and cause warnings
        self.address = address
        self._libraries = libraries
        self.under_way: dict[Future[Any], Any] = {}  # names of calls
        self._own: _Local | None = None
        try:
            if address.partition(":")[0] == LOCAL:
                self._own = _Local(address)
            where = self._own.address if self._own else address
            # in two steps, as a client that fails to connect must be closed too: it would delay our exit
            self._client: Client = distributed.Client.__new__(distributed.Client)
            self._client.__init__(where, timeout=WAIT_S, set_as_default=False)  # type: ignore[misc]
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
        known: int = self._client._scheduler_identity.get("n_workers", 0)  # asking would wait for an answer
        return known or self._first

    @property
    def full(self) -> bool:
        """True where no further call should be sent before one is taken."""
        return len(self.under_way) >= AHEAD * self.count

    @property
    def ready(self) -> bool:
        """True where `take` returns at once."""
        return bool(self.under_way) and bool(self._done.has_ready())

    def send(self, name: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Submit a call of one of our functions under a name; the worker compares fingerprints first."""
        ours = self._libraries, fingerprint(self._libraries)
        future = self._client.submit(_checked, *ours, function, *arguments, pure=False)
        self.under_way[future] = name
        self._done.add(future)

    def take(self) -> tuple[Any, Callable[[], Any]]:
        """Wait for the next call that is done: its name, and a function that returns its result.

        That one raises the call's exception, `GivenUp`, or `RenderError`.
        """
        future = next(self._done)
        return self.under_way.pop(future), partial(self._result, future)

    def _result(self, future: Future[Any]) -> Any:
        from distributed.comm.core import CommClosedError
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise GivenUp(f"given up: {error.allowed_failures + 1} workers ended over it") from None
        except (CancelledError, CommClosedError, TimeoutError):
            fact = f"the scheduler at `{self.address}` is gone"
            raise RenderError(f"{fact}; the same command goes on with what is left") from None

    def close(self) -> None:
        """Cancel pending tasks and end workers of this machine."""
        with contextlib.suppress(Exception):  # there may be none yet, or none any more
            self._client.close(timeout=2)
        if self._own is not None:
            self._own.close()

    def _compare(self) -> int:
        """Number of workers; raises `RenderError` where one would give other results."""
        result = self._client.run(fingerprint, self._libraries, on_error="return")
        for address, theirs in result.items():
            if not isinstance(theirs, dict):
                raise RenderError(f"worker {address} cannot run scenelang: {_told(theirs)}")
            fatal, harmless = differences(fingerprint(self._libraries), theirs)
            if fatal:
                raise RenderError(f"worker {address} has {fatal[0]}")
            for fact in harmless:
                logging.getLogger("scenelang").warning("worker %s has %s", address, fact)
        return len(result)


def by_workers(
    address: str, function: Callable[[T], R], items: Iterable[tuple[K, T]], libraries: tuple[str, ...] = ()
) -> Iterator[tuple[K, Callable[[], R]]]:
    """Map one of our functions over named arguments, each taken when it can be sent, by a `Connection`.

    Yields names in the order in which they are done, each with a function that returns the result or raises
    as `Connection.take` says, to be called before the next name is taken.
    """
    link = Connection(address, libraries)
    try:
        for name, item in items:
            link.send(name, function, item)
            while link.ready or link.full:
                yield link.take()
        while link.under_way:
            yield link.take()
    finally:
        link.close()


class _Local:
    """A scheduler in this process, reachable from this machine alone, and a plain process for each core."""

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
        """Stop all of it at once; dask would wait for running tasks."""
        for worker in self._workers:
            worker.terminate()
        latest = time.monotonic() + _END_S
        for worker in self._workers:
            with contextlib.suppress(subprocess.TimeoutExpired):
                worker.wait(max(0.0, latest - time.monotonic()))
            worker.kill()  # also ends its own processes
            worker.wait()
        self._cluster.close()


def _told(error: object) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


# ---------------------------------------------------------------- on workers


def _checked(
    libraries: tuple[str, ...], ours: dict[str, str], function: Callable[..., Any], *arguments: Any
) -> Any:
    """Call a function if the fingerprint of the caller is that of this machine."""
    fatal, _ = differences(ours, fingerprint(libraries))
    if fatal:
        raise RenderError(f"a worker has {fatal[0]}")
    return function(*arguments)


@cache
def fingerprint(libraries: tuple[str, ...] = ()) -> dict[str, str]:
    """Facts that determine results on this machine: versions, digests of the code and of models' weights."""
    result = {"python": platform.python_version(), "processor": platform.machine()}
    for name in (*_NEEDED, *libraries):
        try:
            result[name] = version(name)
        except PackageNotFoundError:
            result[name] = "none"
    package = MODELS.parent
    code = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        code.update(file.relative_to(package).as_posix().encode() + file.read_bytes())
    result["scenelang's code"] = code.hexdigest()[:12]
    for weights in sorted(MODELS.glob("*/weights.safetensors")):
        result[f"weights of {weights.parent.name}"] = hashlib.sha256(weights.read_bytes()).hexdigest()[:12]
    return result


def differences(ours: dict[str, str], theirs: dict[str, str]) -> tuple[list[str], list[str]]:
    """Differences of a worker in words: those that change results, and those that hardly do."""
    result: tuple[list[str], list[str]] = [], []
    for name in sorted(ours.keys() | theirs.keys()):
        here, there = ours.get(name, "none"), theirs.get(name, "none")
        if here != there:
            result[name in _HARMLESS].append(f"{name} {there}, where {here} is here")
    return result
