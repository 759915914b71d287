"""The process that reads strangers' files: its bounds, and that nothing leaves it."""

from __future__ import annotations

import signal
import sys
from typing import Any

import pytest

pytest.importorskip("igl")

from scenelang.drawing.exact.mesh import FitError
from scenelang.inverse import sandbox
from scenelang.inverse.sandbox import SandboxProcess

CODE = sandbox._CODE
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such bounds")


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What code makes of bytes in such a process."""

    def ask(code: str, cpu_s: float = 60.0, read_s: float = 60.0) -> tuple[bytes, list[Any]]:
        start, *_ = CODE.partition("sandbox.serve")
        work = f"def make(request, data, tell):\n    import os\n    {code}\nsandbox.serve(make)\n"
        monkeypatch.setattr(
            sandbox, "_CODE", f"{start}sandbox.READ_S = {read_s}\nsandbox.MEGABYTE_S = 0\n{work}"
        )
        heard: list[Any] = []
        with SandboxProcess() as process:
            answers = [process({"cpu_s": cpu_s}, b"abc", {"say": heard.append}) for _ in range(2)]
        assert answers[0] == answers[1]
        return answers[0], heard

    return ask


def test_answers(made: Any) -> None:
    assert made("print('noise', flush=True); tell('say', 'a'); return data * 2") == (b"abcabc", ["a", "a"])


def test_what_was_read_has_longer(made: Any) -> None:
    work = "import time; end = time.process_time() + 2.2\n    while time.process_time() < end: pass"
    assert made(f"tell('say', 'read')\n    {work}\n    return data", 60.0, 1.0)[0] == b"abc"
    with pytest.raises(FitError, match="takes too much processor time"):
        made(f"{work}\n    return data", 60.0, 1.0)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("while True: pass", "takes too much processor time"),
        ("return bytes(sandbox.MEMORY)", r"more than 1,024 MiB of memory"),
        (f"os.kill(os.getpid(), {int(signal.SIGSEGV)})", f"has failed .signal {int(signal.SIGSEGV)}"),
        ("os._exit(3)", "has failed .status 3"),
        ("raise sandbox.FitError('what is wrong')", "^what is wrong$"),
        ("return 1 / 0", "has failed .ZeroDivisionError: division by zero"),
        ("import socket; socket.create_connection(('127.0.0.1', 9))", "has failed .PermissionError: socket"),
        ("os.system('true')", "has failed .PermissionError: os.system"),
    ],
)
def test_what_ends_it_is_an_error_of_the_file(made: Any, code: str, words: str) -> None:
    with pytest.raises(FitError, match=words):
        made(code, 1.0)


def test_what_workers_of_dask_set_does_not_slow_it_down(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("MALLOC_TRIM_THRESHOLD_", "65536"), ("OMP_NUM_THREADS", "1")):
        monkeypatch.setenv(name, value)
    names = "'MALLOC_TRIM_THRESHOLD_', 'IGL_NUM_THREADS', 'OPENBLAS_NUM_THREADS'"
    found, _ = made(f"return repr([os.environ.get(name) for name in ({names})]).encode()")
    assert found == b"[None, '1', '1']"
