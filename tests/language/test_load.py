"""The library's way in: `load`, `loads`, and what importing costs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import scenelang as nsg

TEXT = "param k = 0.5 in 0..1; square { scale(0.1 + k); }"


def test_load(tmp_path: Path) -> None:
    path = tmp_path / "a.nsg"
    path.write_text(TEXT)
    expected = nsg.Scene(nodes=(nsg.Object("square", transforms=(nsg.Scale.uniform(1.0),)),))
    assert nsg.load(path, k=0.9) == expected
    assert nsg.load(str(path), k="0.9") == expected
    assert nsg.load(path, params={"k": 0.9}) == expected
    assert nsg.loads(TEXT, k=0.9) == expected


def test_errors_carry_all_diagnostics() -> None:
    with pytest.raises(nsg.SceneError) as caught:
        nsg.loads("square { rotate(45); scale(foo); }")
    assert [d.code for d in caught.value.diagnostics] == ["E0302", "E0201"]
    assert "E0302" in str(caught.value)


def test_warnings_are_collected() -> None:
    found = nsg.Diagnostics()
    nsg.loads("square { material flat { color([2, 0, 0]); } }", diagnostics=found)
    assert [d.code for d in found] == ["W0301"]


def test_imports_need_a_root(tmp_path: Path) -> None:
    (tmp_path / "lib.nsg").write_text("let x = 2;")
    text = 'import "lib.nsg" as lib; square { scale(lib.x); }'
    assert nsg.loads(text, root=tmp_path).nodes[0].transforms == (nsg.Scale.uniform(2),)
    with pytest.raises(nsg.SceneError):
        nsg.loads(text)


def test_frames() -> None:
    scene = nsg.loads("animate(1, 10); square { translate(u, 0); }", frame=5)
    assert scene.nodes[0].transforms == (nsg.Translate(x=0.5, y=0),)


@pytest.mark.torch
def test_public_names() -> None:
    assert nsg.__all__ == sorted(nsg.__all__)
    assert set(nsg.__all__) <= set(dir(nsg))
    for name in nsg.__all__:
        assert not Path(str(nsg.__file__)).with_name(name).is_dir()  # importing a package would hide it
        assert getattr(nsg, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'lode'"):
        nsg.lode  # noqa: B018


def imported(code: str) -> set[str]:
    """Top-level modules that a fresh interpreter has after ``code``."""
    listing = f"{code}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", listing], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_what_is_imported() -> None:
    heavy = {"torch", "numpy", "pydantic", "lark", "rich", "PIL"}
    assert not imported("import scenelang") & heavy
    assert not imported("import scenelang as nsg; nsg.loads('square {}')") & (heavy - {"pydantic"})


def test_a_model_that_is_not_named_is_that_of_the_dimension() -> None:
    for text, name in (("square { twirl(1); }", "shapes2d"), ("sphere;", "solids3d"), ("", "shapes2d")):
        assert nsg.compile(nsg.loads(text)).model == name
    assert nsg.compile(nsg.loads('model "textures2d"; square;')).model == "shapes2d"  # its earlier name
    with pytest.raises(nsg.SceneError, match="E0514"):
        nsg.compile(nsg.Scene(model="other"))
