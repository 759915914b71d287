"""A scheduler and a worker that talk by TLS alone, with certificates as docs/sweep.md has them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.output import workers
from scenelang.output.workers import Link
from tests.output.conftest import started

pytestmark = pytest.mark.skipif(not shutil.which("openssl"), reason="openssl makes the certificates")
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


def test_only_who_has_the_certificate_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import dask

    (tmp_path / "a.nsg").write_text(SCENE)
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
                timeout=30,  # a connection that fails does not hold up the end
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
                Link(where)
            assert str(caught.value).startswith(f"no scheduler with workers at `{where}`: ")
            assert "\n" not in str(caught.value)
