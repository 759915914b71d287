"""Scenes built in Python: constructors in their short forms, and what they refuse in plain words."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import scenelang as nsg

ROOT = Path(__file__).parents[2]
STAR = nsg.Object("star")


def test_short_forms() -> None:
    rows: list[tuple[object, object]] = [
        (nsg.Translate(1, 2), nsg.Translate(x=1, y=2, z=0)),
        (nsg.Translate(1, 2, 3), nsg.Translate(x=1, y=2, z=3)),
        (nsg.Scale(2), nsg.Scale(x=2, y=2, z=2)),
        (nsg.Scale(x=2), nsg.Scale.uniform(2)),
        (nsg.Scale(2, 3), nsg.Scale(x=2, y=3, z=1)),
        (nsg.Scale(2, 3, 4), nsg.Scale(x=2, y=3, z=4)),
        (nsg.Shear("yx", 0.5), nsg.Shear(axes="yx", k=0.5)),
        (nsg.Twirl(1), nsg.Twirl(k=1)),
        (nsg.Displace(0.1, 8), nsg.Displace(amount=0.1, frequency=8)),
        (nsg.Grow(0.1), nsg.Grow(r=0.1)),
        (nsg.Shell(0.1), nsg.Shell(w=0.1)),
        (nsg.Hue.degrees(180), nsg.Hue(angle=math.pi)),
        (nsg.Color("#f80"), nsg.Color(rgb=(1, 136 / 255, 0))),
        (nsg.Color((1, 0, 0)), nsg.Color.hex("#ff0000")),
        (nsg.Animation(2, 24), nsg.Animation(seconds=2, fps=24, loop=True)),
        (nsg.Material("flat", nsg.Color("#fff")), nsg.Material(name="flat", ops=(nsg.Color("#fff"),))),
        (nsg.Material("flat", "#f00"), nsg.Material("flat", nsg.Color((1, 0, 0)))),
        (nsg.Object("star", nsg.Twirl(1)), nsg.Object(geometry="star", transforms=(nsg.Twirl(1),))),
        (nsg.Boolean("smooth", [STAR, STAR]), nsg.Boolean(op="smooth", children=(STAR, STAR))),
        (
            nsg.Chain((STAR, nsg.Link("subtract", STAR))),
            nsg.Chain(children=(nsg.Link(node=STAR), nsg.Link(op="subtract", node=STAR))),
        ),
        (nsg.Scene(nodes=STAR), nsg.Scene(nodes=(STAR,))),
        (nsg.Light(color="#d33").color, nsg.Color("#dd3333").rgb),
        (nsg.Scene(background="#d33").background, nsg.Color("#d33").rgb),
        (nsg.Ground(color="default"), nsg.Ground()),
    ]
    assert [(short, long) for short, long in rows if short != long] == []


def test_plain_words() -> None:
    rows: list[tuple[Callable[[], object], str]] = [
        (lambda: nsg.Rotate(45), "write Rotate.degrees(45), or Rotate(angle=45) for radians"),  # type: ignore[call-arg]
        (lambda: nsg.Hue(1), "write Hue.degrees(1)"),  # type: ignore[call-arg]
        (lambda: nsg.Translate("a", 1), "Translate: `x` is 'a', not a number"),  # type: ignore[arg-type]
        (lambda: nsg.Translate(1), "Translate: `y` is missing"),  # type: ignore[call-arg]
        (lambda: nsg.Translate(1, 2, x=1), "`x` is given twice"),  # type: ignore[misc]
        (lambda: nsg.Translate(1, 2, 3, 4), "4 arguments, where it takes at most 3: x, y, z"),  # type: ignore[call-arg]
        (lambda: nsg.Flip(1), "1 argument, where it takes none"),  # type: ignore[call-arg, arg-type]
        (lambda: nsg.Object("star", transfroms=()), "did you mean `transforms`?"),  # type: ignore[call-arg]
        (lambda: nsg.Object("star", nsg.Flip()), "`transforms[0]` is a Flip"),  # type: ignore[arg-type]
        (lambda: nsg.Object("two words"), "`geometry`: not a possible name"),
        (lambda: nsg.Scale(0), "a scale by 0"),
        (lambda: nsg.Color("red"), "`red` is not a colour such as `#d33`"),
        (lambda: nsg.Material("flat", "red"), "`red` is not a colour such as `#d33`"),
        (lambda: nsg.Light(color="red"), "Light: `red` is not a colour such as `#d33`"),
        (lambda: nsg.Scene(background="#12"), "Scene: `#12` is not a colour such as `#d33`"),
        (lambda: nsg.Scene(camera=nsg.Light()), "`camera` is Light(), not a Camera"),  # type: ignore[arg-type]
        (lambda: nsg.Camera((0, 0, 0)), "the eye is the target"),
        (lambda: nsg.Camera(fov=1e-20), "too narrow"),
        (lambda: nsg.Light(power=-1), "power"),
        (lambda: nsg.Light((0, 1e13, 0)), "position"),
        (lambda: nsg.Ground(-1e13), "y"),
        (lambda: nsg.Boolean("smooth", k=0), "k"),
        (lambda: nsg.Link("union", STAR, 0.3), "`union` has no k"),
        (lambda: nsg.Rotate(angle=1, axis=(0, 0, 0)), "an axis of length 0"),
        (lambda: nsg.Translate(math.inf, 0), "Translate: `x`"),
        (lambda: nsg.Matrix(((1, 0, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))), "a singular matrix"),
        (lambda: nsg.Chain([nsg.Link("subtract", STAR)]), "the first child of a chain"),
        (lambda: nsg.Scene(canvas=(0, 1)), "`canvas[0]`"),
        (lambda: nsg.Scene(model='a"b'), "`model`: not a possible name"),
        (lambda: nsg.Scene((STAR,)), "Scene takes its arguments by name"),  # type: ignore[call-arg, arg-type]
    ]
    wrong = []
    for make, words in rows:
        with pytest.raises((TypeError, ValueError)) as caught:
            make()
        if words not in str(caught.value) or "pydantic" in f"{type(caught.value)} {caught.value}":
            wrong.append((words, caught.value))
    assert wrong == []


def test_data_keeps_to_its_one_form() -> None:
    star: dict[str, object] = {"kind": "object", "geometry": "star"}
    for node in (
        {**star, "transforms": [{"kind": "scale", "x": 1}]},
        {**star, "transforms": [{"kind": "scale", "x": 1, "y": 1}]},
        {**star, "material": {"name": "flat", "ops": [{"kind": "color", "rgb": "#fff"}]}},
        {**star, "transforms": {"kind": "twirl", "k": 1}},
        {"kind": "chain", "children": [star]},
    ):
        with pytest.raises(ValueError, match="validation error"):
            nsg.Scene.model_validate({"nodes": [node]})


@pytest.mark.slow
def test_types_suit_mypy(tmp_path: Path) -> None:
    """What the tests above do is typed as it runs: right calls pass, and each ignored mistake is one."""
    command = [sys.executable, "-m", "mypy", "--strict", "--warn-unused-ignores", __file__]
    options = ["--config-file=", f"--cache-dir={tmp_path}", "--follow-imports=silent"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout


def test_widths_of_cuts() -> None:
    """In JSON from before cuts had widths every node has a `k` of 0.15, which was none."""
    two = [nsg.Object("square"), nsg.Object("star")]
    for node, k in (
        (nsg.Boolean("subtract", two), None),
        (nsg.Boolean("subtract", two, k=0.15), 0.15),
        (nsg.Boolean("intersect", two, k=0.3), 0.3),
        (nsg.Boolean("smooth", two, k=0.15), None),
        (nsg.Boolean("smooth", two, k=0.2), 0.2),
    ):
        scene = nsg.Scene(nodes=node)
        assert nsg.Scene.from_json(scene.to_json()) == scene
        assert node.k == (k if k is None else pytest.approx(k, rel=1e-15))
        assert (f"{node.op}(k = {k}" in scene.to_nsg()) == (k is not None)
    old = '{"nodes": [{"kind": "boolean", "op": "subtract", "children": [], "k": 0.15}]}'
    assert nsg.Scene.from_json(old).nodes[0].k is None  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="`union` has no k"):
        nsg.Boolean("union", two, k=0.2)
