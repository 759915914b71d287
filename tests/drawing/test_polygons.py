"""Polygons and splines: distances against slow loops over their points, pictures against the exact ones and
against other leaves, files.
"""

from __future__ import annotations

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.element import drawn_element, element_of, points_fault
from scenelang.assets.element_file import element_file_bytes, read_zoo
from scenelang.assets.tensors import TensorError
from scenelang.compiler.program import NEWEST, ProgramError, parse_program, program_bytes
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.exact.outline import of_element
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.outlines import OutlineShapes, table_of
from tests.drawing.slow import distances_of_edges

Points = tuple[tuple[float, float], ...]
STAR: Points = tuple((math.cos(k * 0.8 * math.pi), math.sin(k * 0.8 * math.pi)) for k in range(5))
ROOF: Points = ((0, 0), (3, 0), (3, 2), (2, 0.5), (1, 2), (0, 2))
TWICE: Points = ((0, 0), (2, 0), (2, 2), (0, 2)) * 2  # around twice, so that each edge lies on another
EIGHT: Points = (
    (0, 0),
    (1, 0),
    (1, 1),
    (0, 1),
    (0, 0),
    (-1, 0),
    (-1, -1),
    (0, -1),
)  # meets itself in a point
HAIR: Points = ((0, 0), (1, 0), (1, 1e-5), (5, 0.5), (1, 1e-5), (0, 1))  # with an edge that goes and returns


def wild(count: int, seed: int) -> Points:
    return tuple(map(tuple, np.random.default_rng(seed).uniform(-1, 1, (count, 2)).tolist()))


SHAPES = {
    **{"star": STAR, "roof": ROOF, "twice": TWICE, "eight": EIGHT, "hair": HAIR},
    **{f"wild {count}": wild(count, count) for count in (3, 4, 9, 40, 200)},
}


def flattened(form: str, points: Points) -> list[tuple[float, float]]:
    """The points of a closed line, of a spline 400 on each of its curves."""
    if form == "polygon":
        return [*points]
    line, n = [], len(points)
    for k in range(n):
        (ax, ay), (bx, by), (cx, cy), (dx, dy) = (points[(k + step) % n] for step in (-1, 0, 1, 2))
        for at in range(400):
            t = at / 400  # the Catmull-Rom polynomial, not its Bézier form
            weights = [-t / 2 + t * t - t**3 / 2, 1 - 2.5 * t * t + 1.5 * t**3]
            weights += [t / 2 + 2 * t * t - 1.5 * t**3, -t * t / 2 + t**3 / 2]
            line.append((np.dot(weights, (ax, bx, cx, dx)), np.dot(weights, (ay, by, cy, dy))))
    return line


def slow(line: list[tuple[float, float]], p: np.ndarray) -> np.ndarray:
    """Signed distances (M,) at points (M, 2) of a closed line."""
    return distances_of_edges(np.array(line), np.roll(line, -1, 0), p)


@pytest.mark.parametrize(
    ("form", "name"),
    [
        (form, name)
        for form in ("polygon", "spline")
        for name in SHAPES
        if (form, name) != ("spline", "wild 200")
    ],
)
def test_distances_are_those_of_a_slow_loop(form: str, name: str) -> None:
    random = np.random.default_rng(len(name))
    element, middle, radius = drawn_element(form, SHAPES[name])
    p = np.concatenate([random.uniform(-1.1, 1.1, (200, 2)), random.normal(0, 3, (20, 2))])
    own = slow(flattened(form, SHAPES[name]), p * radius + middle) / radius
    assert abs(of_element(element).distances(p) - own).max() < 1e-5
    others = [drawn_element("polygon", ROOF)[0], element]
    shape = OutlineShapes(NUMPY, others, np.zeros(1, np.float32))
    found = shape.distance(p.T.astype(np.float32), np.ones(len(p), np.intp))
    assert abs(found - own).max() < 2e-5  # 1e-5 of the size


def test_points_of_edges_are_cut_at_none() -> None:
    """A thousand points whose edges all cross take a second, not half a million crossings."""
    element, _, _ = drawn_element("polygon", wild(1000, 1))
    start = time.process_time()
    table = table_of(element)
    assert time.process_time() - start < 4
    assert table.pieces.shape[1] == 1000


SCENE = """canvas(128, 128); background(#fed);
    smooth { polygon([[5, 5], [9, 6], [7, 9], [6, 5.5]]) { scale(0.1); material flat { color(#148); } }
      spline([[-1, 0], [1, 0], [1, 1], [-1, -1]]) { scale(0.3); material flat { color(#c40); } } }
    polygon([for (i in 0..<5) [cos(i * 144deg), sin(i * 144deg)]]) { grow(0.05); scale(0.4); twirl(1);
      translate(-0.5, 0.5); material checker { scale(0.3); } }
    subtract { spline([[-0.9, -0.9], [-0.2, -0.8], [-0.5, -0.2]]) { shell(0.1); }
      spline([[-0.6, -0.9], [-0.2, -0.9], [-0.5, -0.6]]); }"""


@pytest.mark.torch
def test_pictures_are_those_of_the_exact_shapes() -> None:
    scene = nsg.loads(SCENE)
    found, exact = nsg.render(scene), nsg.render(scene, backend="reference")
    assert psnr(found, exact) > 49
    assert abs(np.asarray(nsg.render(scene, device="cpu")) - np.asarray(found)).max() < 1.5 / 255


def random_text(seed: int) -> str:
    """A scene of polygons and splines with skins, blends and cuts."""
    random = np.random.default_rng(seed)

    def leaf() -> str:
        points = random.uniform(-9, 9, (random.integers(3, 12), 2)).round(3).tolist()
        skin = ["", "grow(0.5);", "shell(1);", "grow(-0.4); shell(2);"][random.integers(4)]
        x, y = random.uniform(-0.5, 0.5, 2)
        moves = f"scale(0.06); rotate({random.uniform(0, 360)}deg); translate({x}, {y});"
        colour = "material flat { color([" + ", ".join(map(str, random.uniform(0, 1, 3))) + "]); }"
        return f"{random.choice(['polygon', 'spline'])}({points}) {{ {skin} {moves} {colour} }}"

    joins = "union", "smooth", "subtract", "intersect", "smooth(k = 0.3)", "subtract(k = 0.1)"
    parts = (f"{random.choice(joins)} {{ {leaf()} {leaf()} }}" for _ in range(2))
    return f"canvas(48, 40); background(#ccb); {leaf()} {' '.join(parts)}"


def test_random_pictures_are_those_of_the_exact_shapes() -> None:
    scenes = [nsg.loads(random_text(seed)) for seed in range(8)]
    found = [psnr(nsg.render(scene), nsg.render(scene, backend="reference")) for scene in scenes]
    assert np.mean(found) > 49


SAME = {
    "square { material checker { scale(0.3); rotate(20deg); } rotate(10deg); }": """
        polygon([[-a, -a], [a, -a], [a, a], [-a, a]]) {
          material checker { scale(0.3); rotate(20deg); } rotate(10deg); }""",
    "square { grow(0.2); shell(0.1); scale(0.5); material linear { stop(0, #d33); stop(1, #33d); } }": """
        polygon([[-a, a], [a, a], [a, -a], [-a, -a]]) { grow(0.2); shell(0.1); scale(0.5);
          material linear { stop(0, #d33); stop(1, #33d); } }""",
    "square { shell(0.2); scale(0.4); translate(0.2, 0.1); twirl(1); }": """
        polygon([[5, 5], [5 + 8 * a, 5], [5 + 8 * a, 5 + 8 * a], [5, 5 + 8 * a]]) { shell(0.8);
          translate(-5 - 4 * a, -5 - 4 * a); scale(0.1); translate(0.2, 0.1); twirl(1); }""",
}


@pytest.mark.parametrize("text", SAME)
def test_a_square_by_its_points_is_a_square(text: str) -> None:
    """Units of `grow`, `shell` and textures are those of the points."""
    head = "canvas(96, 80); background(#fed); let a = sqrt(0.5);"
    square, other = (nsg.loads(f"{head} group {{ {one} scale(0.8); }}") for one in (text, SAME[text]))
    assert psnr(nsg.render(square, backend="reference"), nsg.render(other, backend="reference")) > 49
    assert psnr(nsg.render(square), nsg.render(other)) > 45


def test_what_grows_without_limit() -> None:
    other = "disc { scale(0.2); translate(-1, 1); material flat { color(#000); } }"
    scene = nsg.loads(f"background(#248); polygon([[0, 0], [1e-3, 0], [0, 1e-3]]) {{ grow(0.5); }} {other}")
    disc = nsg.loads(f"background(#248); disc {{ scale(0.5); }} {other}")
    assert psnr(nsg.render(scene), nsg.render(disc)) > 35


TRIANGLE = "polygon([[0, 0], [1, 0], [0, 1]])"


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        (f"sphere; {TRIANGLE};", "E0501", "leaf of the plane"),
        (f'model "solids3d"; {TRIANGLE.replace("polygon", "spline")};', "E0501", "leaf of the plane"),
        (f'model "shapes2d-reading"; {TRIANGLE};', "E0501", "usual model draws it"),
        ("polygon([[0, 0], [1e99, 0], [0, 1e99]]);", "E0312", "scale it"),
        (f"{TRIANGLE} {{ grow(1e50); }}", "E0312", "scale it"),
        (f"{TRIANGLE} {{ grow(-9); }}", "W0404", "shrink it less"),
    ],
)
def test_what_no_model_draws_is_told(text: str, code: str, said: str) -> None:
    [found] = [d for d in nsg.check_text(text) if d.code not in ("E0509", "E0510")]
    assert found.code == code
    assert said in (found.help or "")
    assert "polygon_" not in found.message


def test_programs_keep_points_and_those_of_before_their_format() -> None:
    program = nsg.compile(nsg.loads(SCENE))
    data = program_bytes(program)
    again = parse_program(data)
    assert again.elements == program.elements
    assert (again.digest(), program_bytes(again)) == (program.digest(), data)
    assert f'format\\":{NEWEST}' in data[:4000].decode("utf-8", "replace")
    assert program.objects[:2] == ("polygon", "spline")
    assert 'format\\":5' in program_bytes(nsg.compile(nsg.loads("square { shell(0.1); }")))[:4000].decode(
        "utf-8", "replace"
    )
    equal = nsg.compile(nsg.loads("let p = [[0, 0], [1, 0], [0, 1]]; for (i in 0..<3) { polygon(p); }"))
    assert len(equal.elements) == 1


def test_headers_of_files_do_not_grow_with_polygons() -> None:
    text = "for (i in 0..<{}) {{ polygon([[0, 0], [1, 0], [0.5, 1 + i]]) {{ scale(0.01); }} }}"
    few, many = (program_bytes(nsg.compile(nsg.loads(text.format(count)))) for count in (2, 90))
    assert len(parse_program(many).elements) == 90
    assert int.from_bytes(many[:8], "little") < int.from_bytes(few[:8], "little") + 100


def test_damaged_points_are_refused() -> None:
    program = nsg.compile(nsg.loads("polygon([[0, 0], [1, 0], [0, 1]]); square;"))
    data = program_bytes(program)
    points = np.array(program.elements[0].points)
    for other in (points * 2, points * 0, points[[0, 0, 1]]):
        with pytest.raises(ProgramError, match="points are none"):
            parse_program(data.replace(points.tobytes(), other.tobytes()))


def test_scenes_in_python_and_json() -> None:
    points = [(0, 0), (1, 0), (0.5, 0.8)]
    moves = (nsg.Grow(7.0), nsg.Scale(0.1))
    scene = nsg.Scene(nodes=(nsg.polygon(points, moves), nsg.spline(points), nsg.Object("square")))
    text = scene.model_dump_json()
    assert nsg.Scene.model_validate_json(text) == scene
    assert "points" not in json.loads(text)["nodes"][2]
    assert nsg.loads(scene.to_nsg()) == scene
    for bad, said in (
        ([(0, 0), (1, 1)], "2 points"),
        ([(0, 0), (1, 1), (3, 3)], "on a line"),
        ([(0, 0)] * 2 + [(1, 1)], "2 different points"),
        ([(0, 0), (1, math.nan), (3, 3)], "finite"),
        ([(0, 0), (1, 0, 2), (3, 3)], "points"),
        ([(0, 0), (1, 0), (3, 3)] * 400, "1000"),
        (3, "points"),
    ):
        with pytest.raises(ValueError, match=said):
            nsg.polygon(bad)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no points"):
        nsg.Object("square", points=points)
    with pytest.raises(ValueError, match=r"outside -0\.5\.\.1"):
        nsg.Object("square", nsg.Grow(7.0))


def test_points_on_a_line_are_told_from_thin_ones() -> None:
    turn = np.array([[math.cos(0.3), math.sin(0.3)], [-math.sin(0.3), math.cos(0.3)]])
    for far in (0.0, 1e6):
        line = np.array([[0, 0], [1, 0], [0.3, 0], [0.7, 0]]) @ turn + far
        assert points_fault(tuple(map(tuple, line.tolist()))) == "points that all lie on a line"
        thin = np.array([[0, 0], [1, 0], [0.3, 1e-6]]) @ turn + far
        assert points_fault(tuple(map(tuple, thin.tolist()))) is None


def test_bad_points_in_much_text_take_no_time() -> None:
    points = ", ".join(f"[{k}, {k}]" for k in range(900))
    text = f"polygon([{points}]); spline([{points}, 3]);" * 4 + "polygon([for (i in 0..<50000) [i, i]]);"
    start = time.process_time()
    found = nsg.check_text(text)
    assert time.process_time() - start < 2
    assert {d.code for d in found} == {"E0301", "E0311"}


def test_frames_keep_the_points_of_what_stays(tmp_path: Path) -> None:
    text = f"canvas(24, 24); animate(1s, 3); {TRIANGLE} {{ scale(0.5); }} spline([[t, 0], [1, -1], [0, 1]]);"
    (tmp_path / "a.nsg").write_text(f"background(#248); {text}")
    for frame, picture in enumerate(nsg.render_frames(tmp_path / "a.nsg")):
        alone = nsg.render(nsg.load(tmp_path / "a.nsg", frame=frame))
        np.testing.assert_array_equal(np.asarray(picture), np.asarray(alone))


def test_elements_in_files_are_not_points() -> None:
    with pytest.raises(TensorError, match="form"):
        read_zoo(element_file_bytes([element_of("polygon", ((0, 0), (1, 0), (0, 1)))]))
