"""The library that ships: what its shapes are, against closed forms, and how it is imported."""

from __future__ import annotations

import contextlib
import math
import random
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.exact.solid import ExactField as Solid
from scenelang.drawing.render import exact_graph
from scenelang.language import foreign, library
from scenelang.language.diagnostics import SourceFile, apply_fixes
from scenelang.language.evaluation import Source
from tests.drawing import oracle

Field = Callable[[float, float], float]
ROUND, SHARP = 0.0025, 1e-6  # how near to an outline its closed form decides nothing
IMPORT = 'import "std/shapes" as s; '


def polygon(*corners: tuple[float, float]) -> Field:
    return lambda x, y: oracle.polygon_distance(list(corners), x, y)


def regular(n: int, *radii: float) -> Field:
    turns = [math.tau * i / n for i in range(n)]
    return polygon(
        *[
            (radii[i % len(radii)] * math.sin(a), radii[i % len(radii)] * math.cos(a))
            for i, a in enumerate(turns)
        ]
    )


def disc(r: float) -> Field:
    return lambda x, y: math.hypot(x, y) - r


def band(r: float, width: float) -> Field:
    return lambda x, y: abs(math.hypot(x, y) - r + width / 2) - width / 2


def sector(start: float, end: float) -> Field:
    """Of less than half a turn, in degrees: to the left of one ray and to the right of the other."""
    a, b = math.radians(start), math.radians(end)
    return lambda x, y: max(x * math.sin(a) - y * math.cos(a), y * math.cos(b) - x * math.sin(b))


def both(*fields: Field) -> Field:
    return lambda x, y: max(f(x, y) for f in fields)


def any_of(*fields: Field) -> Field:
    return lambda x, y: min(f(x, y) for f in fields)


def without(a: Field, b: Field) -> Field:
    return lambda x, y: max(a(x, y), -b(x, y))


def segment(ax: float, ay: float, bx: float, by: float, width: float) -> Field:
    """A line with round ends."""
    ex, ey = bx - ax, by - ay

    def distance(x: float, y: float) -> float:
        t = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)))
        return math.hypot(x - ax - t * ex, y - ay - t * ey) - width / 2

    return distance


def rounded(w: float, h: float, r: float) -> Field:
    def distance(x: float, y: float) -> float:
        p, q = abs(x) - w / 2 + r, abs(y) - h / 2 + r
        return math.hypot(max(p, 0), max(q, 0)) + min(max(p, q), 0) - r

    return distance


BOX = polygon((-0.6, -0.3), (0.6, -0.3), (0.6, 0.3), (-0.6, 0.3))
ARROW = any_of(
    polygon((-0.6, -0.05), (0.42, -0.05), (0.42, 0.05), (-0.6, 0.05)),
    polygon((0.6, 0), (0.4, 0.09), (0.4, -0.09)),
)
SHAPE_FIELDS = {
    "rect(1.2, 0.6)": (BOX, SHARP),
    "rect(0.8)": (polygon((-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)), SHARP),
    "parallelogram([-0.5, -0.5], [0.9, 0.1], [0.2, 0.7])": (
        polygon((-0.5, -0.5), (0.4, -0.4), (0.6, 0.3), (-0.3, 0.2)),
        SHARP,
    ),
    "corners([-0.5, -0.5], [0.9, 0.1], [0.2, 0.7])": (
        polygon((-0.5, -0.5), (0.9, 0.1), (0.2, 0.7)),
        SHARP,
    ),
    "line([-0.5, -0.3], [0.4, 0.6], 0.2)": (
        polygon(
            *[
                (x + 0.1 * dx / math.sqrt(2), y + 0.1 * dy / math.sqrt(2))
                for x, y, dx, dy in (
                    (-0.5, -0.3, 1, -1),
                    (0.4, 0.6, 1, -1),
                    (0.4, 0.6, -1, 1),
                    (-0.5, -0.3, -1, 1),
                )
            ]
        ),
        SHARP,
    ),
    "arrow([-0.6, 0], [0.6, 0], 0.1, 0.2)": (ARROW, SHARP),
    **{f"polygon({n}, 0.8)": (regular(n, 0.8), SHARP) for n in (3, 4, 5, 6, 7, 12)},
    **{
        f"star({n}, 0.9, {s})": (regular(2 * n, 0.9, 0.9 * s), SHARP)
        for n in (3, 4, 5, 6, 9)
        for s in (0.3, 0.9)
    },
    "disc(0.7)": (disc(0.7), ROUND),
    "disc(0.7, 64)": (disc(0.7), 0.0008),
    "disc(0.03)": (disc(0.03), ROUND),
    "disc(0.015)": (disc(0.015), ROUND),
    "disc(0.7, 16)": (regular(16, 0.7 * math.sqrt(math.tau / (16 * math.sin(math.tau / 16)))), 0.02),
    "ellipse(0.8, 0.5)": (lambda x, y: 0.5 * (math.hypot(x / 0.8, y / 0.5) - 1), ROUND),
    "ring(0.8, 0.2)": (band(0.8, 0.2), ROUND),
    "ring(0.8, 3)": (disc(0.8), ROUND),
    "arc(0.8, 0.2, 30deg, 140deg)": (both(band(0.8, 0.2), sector(30, 140)), ROUND),
    "arc(0.8, 0.2, 140deg, 390deg)": (without(band(0.8, 0.2), sector(30, 140)), ROUND),
    "pie(0.8, 30deg, 50deg)": (both(disc(0.8), sector(30, 50)), ROUND),
    "pie(0.8, -220deg, 30deg)": (without(disc(0.8), sector(30, 140)), ROUND),
    "rounded(1.2, 0.8, 0.2)": (rounded(1.2, 0.8, 0.2), ROUND),
    "rounded(1.2, 0.8, 9)": (rounded(1.2, 0.8, 0.4), ROUND),
    "rounded(1.2, 0.6, 0)": (BOX, SHARP),
    "capsule([-0.5, -0.3], [0.4, 0.6], 0.3)": (segment(-0.5, -0.3, 0.4, 0.6, 0.3), ROUND),
    "path([[-0.5, -0.3], [0.4, 0.6], [0.5, -0.5]], 0.1)": (
        any_of(segment(-0.5, -0.3, 0.4, 0.6, 0.1), segment(0.4, 0.6, 0.5, -0.5, 0.1)),
        ROUND,
    ),
    "disc_mask(0.7)": (disc(0.7), ROUND),
}


def test_shapes_are_their_closed_forms() -> None:
    wrong = []
    for call, (field, near) in SHAPE_FIELDS.items():
        (node,) = nsg.loads(f"{IMPORT} s.{call};").nodes
        random.seed(call)
        reach = 1.0 if "0.0" not in call else 0.05
        points = [(random.uniform(-reach, reach), random.uniform(-reach, reach)) for _ in range(150)]
        decided = [(x, y) for x, y in points if abs(field(x, y)) > near]
        assert len(decided) > 90, call
        for x, y in decided:
            if (oracle.sample(node, x, y, [], None)[0] < 0) != (field(x, y) < 0):
                wrong.append((call, x, y, field(x, y)))
    assert wrong == []


def test_no_seam_shows() -> None:
    """What lies inside a shape is drawn, on the lines where its leaves meet too."""
    wrong, side = [], 48
    at = (np.arange(side) + 0.5) * 2 / side - 1
    for call, (field, _) in SHAPE_FIELDS.items():
        if re.match(r"polygon\(7|star\([59]|star\(6, 0.9, 0.3|disc\(0.7|ring|arc|pie|round", call):
            text = f"{IMPORT} canvas({side}, {side}); background(#000); s.{call};"
            picture = nsg.render(nsg.loads(text), backend="reference")
            inside = np.array([[field(x, -y) < -2 / side for x in at] for y in at])
            if inside.sum() < 15 or (picture[inside] != 1).any():
                wrong.append(call)
    assert wrong == []


def test_shapes_compose() -> None:
    """Over each other and over differences, and out of each other; a mask cuts, and leads a blend."""
    calls = "".join(f"s.{call}; " for call in SHAPE_FIELDS if "mask" not in call and "0.0" not in call)
    found = nsg.Diagnostics()
    for text in (
        f"{calls} group {{ {calls} rotate(10deg); }}",
        "chain { s.disc(0.9); subtract s.ring(0.5); subtract s.pie(0.4, 0deg, 40deg); s.star(6, 0.2); }",
        "chain { square {} s.disc(0.3) { translate(0.5, 0.5); } intersect s.disc_mask(0.8); }",
        "chain { s.disc_mask(0.5); smooth star { scale(0.5); translate(0.4, 0); } }",
        "s.disc(0.3) { twirl(1); bend(0.4); }",
    ):
        nsg.compile(nsg.loads(IMPORT + text), diagnostics=found)
    assert [*found] == []


def test_nothing_is_drawn_without_extent() -> None:
    calls = """rect(0, 1); disc(0); ring(0, 1); arc(1, 0.1, 40deg, 20deg); pie(1, 0deg, 0deg); star(5, 0);
        polygon(6, 0); line([1, 1], [1, 1]); arrow([1, 1], [1, 1]); rounded(1, 0, 0.1); disc_mask(0);
        capsule([0, 0], [1, 0], 0); parallelogram([0, 0], [1, 1], [2, 2]); corners([0, 0], [1, 1], [2, 2])"""
    for call in map(str.strip, calls.split(";")):
        found = nsg.Diagnostics()
        assert len(nsg.compile(nsg.loads(f"{IMPORT} s.{call};"), diagnostics=found)) == 0, call
        assert {d.code for d in found} <= {"W0401"}, call
    solids = """ball(0); block(1, 0); ring(-1); pill(X, Y, -1); wedge(-1); prism(3, -1); tube(1, 1, -1);
        pyramid(1, -1)"""
    for call in map(str.strip, solids.split(";")):
        assert len(nsg.compile(nsg.loads(f'import "std/solids" as s; s.{call};'))) == 0, call


def test_it_is_found_from_anywhere(tmp_path: Path) -> None:
    """From text without a folder and from imports, under one name wherever it is installed."""
    (program,) = {nsg.compile(nsg.loads(f"{IMPORT} s.rect();")).digest()}
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "lib.nsg").write_text(f"{IMPORT} module m() {{ s.rect(); }}")
    (tmp_path / "main.nsg").write_text('import "sub/lib.nsg" as l; l.m();')
    scene = nsg.load(tmp_path / "main.nsg")
    assert nsg.compile(scene).digest() == program
    assert nsg.loads(scene.to_nsg()) == scene


def test_reserved_names_and_the_users_own_files(tmp_path: Path) -> None:
    (tmp_path / "std").mkdir()
    for name in ("shapes", "shapes.nsg", "mine"):
        (tmp_path / "std" / name).write_text("let mine = 1;")

    def codes(path: str, use: str) -> list[tuple[str, str | None]]:
        found = nsg.Diagnostics()
        text = f'import "{path}" as s; square {{ scale({use}); }}'
        with contextlib.suppress(nsg.SceneError):
            nsg.loads(text, root=tmp_path, diagnostics=found)
        return [(d.code, d.help) for d in found]

    assert codes("std/shapes", "s.sides_of(0.3)") == []
    assert codes("std/shapes.nsg", "s.mine") == codes("./std/shapes", "s.mine") == []
    assert codes("std/mine", "s.mine") == [
        (
            "E0214",
            "it has std/letters, std/meshes, std/shapes, std/solids; a file of your own is `./std/mine`",
        )
    ]
    assert [code for code, _ in codes("std/../std/shapes", "s.mine")] == []
    (tmp_path / "std" / "shapes.nsg").unlink()
    found = nsg.Diagnostics()
    with pytest.raises(nsg.SceneError):
        nsg.loads('import "std/shapes.nsg" as s; s.disc();', root=tmp_path, diagnostics=found)
    fixed, _ = apply_fixes(found.items[0].span.source.text, list(found))
    assert nsg.loads(fixed, root=tmp_path).nodes


NEST = "module m(n) {{ if (n > 0) {{ subtract {{ {level} m(n - 1); }} }} else {{ {inmost} }} }}"
"""Composites in each other, n deep."""


def test_mistakes_in_calls_are_shown_at_the_call() -> None:
    """And so are those of the compiler: nothing in the library is the user's to mend."""
    for text, code, where in (
        ('s.disc("a");', "E0303", "s.disc"),
        ("s.line([0, 0], 3deg);", "E0303", "s.line"),
        ("s.arc(1, 0.1, 0, 9);", "E0302", "s.arc"),
        ('import "std/solids" as t; t.prism(2);', "E0312", "t.prism"),
        (f"{NEST.format(level='square {}', inmost='s.disc_mask(1, 8);')} m(16);", "E0409", "s.disc_mask"),
    ):
        found = nsg.Diagnostics()
        scene, spans = Source(text=SourceFile("a.nsg", IMPORT + text)).scene(found)
        if scene is not None:
            with pytest.raises(nsg.SceneError):
                compile_scene(scene, spans=spans, diagnostics=found)
        assert [(d.code, d.span and d.span.text) for d in found] == [(code, where)], list(found)
        (only,) = found
        assert only.message.startswith(f"the arguments of `{where}` do not fit: ") == (code != "E0409")
        assert not any(library.holds(label.span.source) for label in only.labels)


def test_known_shapes_lead_to_the_library() -> None:
    for file, shapes in ((library.SHAPES, foreign.SHAPES), (library.SOLIDS, foreign.SOLIDS)):
        text = (library.find(file) or Path()).read_text("utf-8")
        for call in shapes.values():
            assert f"\nmodule {call.partition('(')[0]}(" in text, call
    modules = set(re.findall(r"^module (\w+)\(", text, re.MULTILINE))
    assert modules == {call.partition("(")[0] for call in foreign.SOLIDS.values()}
    for text, code, help in (
        ("circle { scale(0.5); }", "E0204", "in the plane write disc { scale(r); }"),
        ("Ring(0.2);", "E0204", 'import "std/shapes" as s; then s.'),
        ("octagon() {}", "E0204", 'import "std/shapes" as s; then s.'),
        ("line;", "E0204", 'import "std/shapes" as s; then s.'),
        ('import "std/shapes" as form; let s = 1; ring;', "E0204", "form.ring(r, width)"),
    ):
        (only,) = nsg.check_text(f"nsg 1;\n{text}").errors
        assert (only.code, (only.help or "")[: len(help)]) == (code, help)
    with pytest.raises(nsg.SceneError, match="rect"):
        nsg.loads("square(0.5);")


SOLIDS = {
    "ball(0.6)": lambda x, y, z: math.hypot(x, y, z) - 0.6,
    "block(1, 0.6, 0.8)": lambda x, y, z: max(abs(x) - 0.5, abs(y) - 0.3, abs(z) - 0.4),
    "column(0.5, 1.2)": lambda x, y, z: max(math.hypot(x, z) - 0.5, abs(y) - 0.6),
    "spike(0.5, 1.2)": lambda x, y, z: max(math.hypot(x, z) - 0.5 * (0.6 - y) / 1.2, -y - 0.6),
    "ring(0.6, 0.3)": lambda x, y, z: math.hypot(math.hypot(x, z) - 0.6, y) - 0.15,
    "tube(0.6, 1, 0.2)": lambda x, y, z: max(abs(math.hypot(x, z) - 0.5) - 0.1, abs(y) - 0.5),
    "tube(0.5, 1, 0.7)": lambda x, y, z: max(math.hypot(x, z) - 0.5, abs(y) - 0.5),
    "block(1, -0.6, 0.8)": lambda x, y, z: max(abs(x) - 0.5, abs(y) - 0.3, abs(z) - 0.4),
    "spike(0.5, -1.2)": lambda x, y, z: max(math.hypot(x, z) - 0.5 * (0.6 + y) / 1.2, y - 0.6),
    "dome(-0.8)": lambda x, y, z: max(math.hypot(x, y, z) - 0.8, -y),
    "dome(0.8)": lambda x, y, z: max(math.hypot(x, y, z) - 0.8, -y),
    "wedge(1, 0.6, 0.8)": lambda x, y, z: max(abs(x) - 0.5, abs(z) - 0.4, y - 0.6 * x, -y - 0.3),
    "pyramid(1, 1.2)": lambda x, y, z: max(max(abs(x), abs(z)) - (0.6 - y) / 2.4, -y - 0.6),
    "prism(4, 0.6, 1)": lambda x, y, z: max(abs(x) + abs(z) - 0.6, abs(y) - 0.5),
    "prism(3, 0.8, 1)": lambda x, y, z: max(-z - 0.4, abs(x) * 3**0.5 / 2 + z / 2 - 0.4, abs(y) - 0.5),
    "rounded(1, 0.8, 0.6, 0.2)": lambda x, y, z: (
        math.hypot(max(abs(x) - 0.3, 0), max(abs(y) - 0.2, 0), max(abs(z) - 0.1, 0)) - 0.2
    ),
    "rounded(0.8, -0.8, 0.8, 9)": lambda x, y, z: math.hypot(x, y, z) - 0.4,
    "pill([0.3, -0.2, 0.1], [-0.4, -0.2, 0.1], 0.3)": lambda x, y, z: (
        math.hypot(max(x - 0.3, -0.4 - x, 0), y + 0.2, z - 0.1) - 0.3
    ),
    "rod([0.1, -0.5, 0.2], [0.1, -0.5, -0.6], 0.2)": lambda x, y, z: max(
        math.hypot(x - 0.1, y + 0.5) - 0.2, abs(z + 0.2) - 0.4
    ),
}
"""Below 0 in a shape, and 0 on its outline."""


@pytest.mark.parametrize("call", SOLIDS)
def test_solids_are_their_closed_forms(call: str) -> None:
    scene = nsg.loads(f'import "std/solids" as s; s.{call};')
    program = nsg.compile(scene)
    exact = Solid(exact_graph(scene)[0].root)
    p = np.random.default_rng(1).uniform(-1, 1, (3, 3000))
    wanted = np.array([SOLIDS[call](*point) for point in p.T.tolist()])
    sure = abs(wanted) > 1e-5
    assert ((exact.at(p).d < 0) == (wanted < 0))[sure].all()
    assert (wanted < 0).sum() > 30
    assert len(program) <= 15
