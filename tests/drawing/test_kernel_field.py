"""The kernel's field against the network as it is written, and against the exact reference."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fuzz.kernel import ask, mutated
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Paint, Program, ProgramError
from scenelang.compiler.weights import REPLACED
from scenelang.drawing.closed import ClosedSolids, closed_forms, field_of
from scenelang.drawing.exact.solid import ExactField
from scenelang.drawing.kernel import Asked, KernelError, load_kernel, there_is_a_kernel
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import SolidArrays
from scenelang.drawing.solid.plain import PlainField
from scenelang.drawing.tables import GROWN, NORMS, SILU, Tables
from scenelang.language.evaluation import load, loads
from tests.drawing.solids import (
    LEAVES,
    Object,
    graph,
    moved,
    random_tree,
    scaled,
    tree_field,
    tree_graph,
    turned,
)
from tests.drawing.solids import field as stream
from tests.drawing.test_renderers_solids import COARSE, MOVED, SPACE, STEPS

ROOT = Path(__file__).parents[2]
FILES = sorted([*ROOT.glob("examples/*.nsg"), *ROOT.glob("tests/conformance/cases/[!r]*.nsg")])
FILES = [path for path in FILES if re.search("^camera|^light|^ground", path.read_text("utf-8"), re.MULTILINE)]
KERNEL, CLOSED = load_kernel(), ClosedSolids("solids3d")
TOLERANCE = 1e-5  # of a scene's size


def points(field: SolidField, seed: int, count: int = 1500) -> tuple[np.ndarray, np.ndarray, float]:
    """Points (3, M) in the balls of objects, a reach (M,) for each, and the size of the scene."""
    rng, rows = np.random.default_rng(seed), field.objects.rows
    centres, extents = rows["centre"], rows["extent"][:, None].clip(0, 2)
    which = rng.integers(0, len(centres), count)
    p = centres[which] + rng.uniform(-1, 1, (count, 3)) * extents[which]
    size = float(((centres + extents).max(0) - (centres - extents).min(0)).max())
    return p.T.astype(np.float32), (0.03 * 1.75 ** rng.integers(0, 7, count)).astype(np.float32), size


def hold(field: SolidField, tables: Tables, seed: int = 0, loose: float = 0.01) -> Asked:
    """What the kernel answers is what the network does, but for a part ``loose`` where slopes are abrupt."""
    p, reach, size = points(field, seed)
    with field.xp.inference():
        met = PlainField(field.network, *field.rows, field.paints).near(p, reach, gradient=True, every=True)
    found = KERNEL.field(tables, p, reach, gradient=True, every=True)
    within = abs(met.distance) < reach
    assert within.mean() > 0.05
    assert abs(found.distance - met.distance)[within].max() < TOLERANCE * size
    assert abs(KERNEL.field(tables, p, reach).distance - found.distance).max() == 0
    for mine, theirs in ((found.gradient, met.gradient), (found.register, met.register)):
        assert (abs(mine - theirs).max(0)[within] > 2e-3).mean() <= loose
    assert (found.owner != met.owner)[within].mean() <= loose
    return found


def tables_of(field: SolidField) -> Tables:
    """The tables of what a field was made of."""
    vectors, tokens, brought = field.rows
    return Tables(field.network, vectors, tokens, brought, field.paints)


def of(program: Program) -> tuple[SolidField, Tables]:
    given = (program.vectors, program.tokens, program.brought(), program.paints())
    net = field_of(program, False)
    return SolidField(net, *given), Tables(net, *given)  # type: ignore[arg-type]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_shipped_scenes(path: Path) -> None:
    hold(*of(compile_scene(load(path))))


OWN = (
    "grow(0.2); scale(0.5); twirl(0.9); translate(-1, 0.1, 0);",
    "grow(-0.2); shell(0.3); scale(0.6); bend(0.6); scale(1, 0.7, 0.8); twist(1.1);",
    "shell(0.4); displace(0.05, 9); scale(0.5); twist(0.8); translate(0.4, 0, 0); twirl(1);",
    "displace(0.1, 5); shell(0.2); grow(0.1); scale(0.4); translate(0, 0.7, 0.2);",
)


@pytest.mark.parametrize("leaf", [*LEAVES, "m.teapot"])
def test_leaves_with_skins_and_warps(leaf: str) -> None:
    """Of grids, too, whose distances outside of the cube are sought where they grow."""
    operands = " smooth ".join(f"{leaf} {{ {own} }}" for own in OWN)
    text = f'nsg 1; import "std/meshes" as m; camera(eye = [0, 1, 9]); chain {{ {operands} }}'
    field, tables = of(compile_scene(loads(text)))
    hold(field, tables, loose=0.03)
    assert set(tables.decoders["kind"].tolist()) == {GROWN if "teapot" in leaf else NORMS}


@pytest.mark.parametrize("name", ["castle", "chess", "clouds", "fog", "icecream", "robot", "stones"])
def test_formulas(name: str) -> None:
    """The exact field in the same kernel; where solids touch, rounding says whose the material is."""
    program = compile_scene(load(ROOT / f"examples/{name}.nsg"))
    given = program.vectors, program.tokens, program.brought(), program.paints()
    net = closed_forms(program.model)
    assert isinstance(net, ClosedSolids)
    hold(SolidField(net, *given), Tables(net, *given))


@pytest.mark.parametrize("seed", range(12))
def test_trees(seed: int) -> None:
    """Groups in groups, cuts with rounded edges, media among solids; against the reference, too."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, 4, (0.0, 0.5)[seed % 2])
    field = tree_field(tree)
    tables = tables_of(field)
    hold(field, tables, seed)
    p, reach = rng.uniform(-1.5, 1.5, (3, 2000)), 0.2
    truth = ExactField(tree_graph(tree)).at(p).d.clip(-reach, reach)
    for each, most in ((tables, 6e-3), (tables_of(tree_field(tree, CLOSED)), 1e-5)):
        found = KERNEL.field(each, p.astype(np.float32), reach).distance
        assert abs(found.clip(-reach, reach) - truth).max() < most


def test_far_objects_are_not_met() -> None:
    """Each point meets those in its reach."""
    rng = np.random.default_rng(5)
    balls = [Object("sphere", (scaled(0.1), moved(*rng.uniform(-2, 2, 3)))) for _ in range(48)]
    p, reach = rng.uniform(-2.5, 2.5, (3, 4000)), (0.03 * 1.75 ** rng.integers(0, 7, 4000)).astype(np.float32)
    result = KERNEL.field(tables_of(stream(balls, CLOSED)), p.astype(np.float32), reach)
    truth = ExactField(graph(balls)).at(p).d
    assert abs(np.minimum(result.distance, reach) - np.minimum(truth, reach)).max() < 1e-4
    assert result.met < p.shape[1] * len(balls) / 4


def test_textures() -> None:
    """Pictures and colours of space with operations on colours; gradients are in shipped scenes."""
    again = Paint(SPACE, (("hue", 0.4), ("grayscale", 0.3)))
    objects = [
        Object("torus", (scaled(1.1), turned(0.8)), paint=Paint(COARSE, STEPS), texture=MOVED),
        Object("sphere", (scaled(0.6, 0.4, 0.6), moved(1, 0, 0.6)), token="smooth", paint=Paint(SPACE)),
        Object("sphere", (scaled(0.5), moved(-1, 0, 0)), paint=again),
    ]
    field = stream(objects)
    hold(field, tables_of(field))


def test_layers_with_silu() -> None:
    """Of weights that Programs were saved for."""
    (digest,) = (path.name for path in REPLACED.iterdir() if path.name.startswith("bab13c"))
    net = load_arrays("solids3d", digest).network
    assert isinstance(net, SolidArrays)
    objects = [
        Object("torus", (scaled(0.8),)),
        Object("sphere", (scaled(0.6), moved(0.4, 0, 0)), token="smooth"),
    ]
    field = stream(objects, net)
    tables = tables_of(field)
    assert set(tables.decoders["kind"].tolist()) == {SILU}
    hold(field, tables)


def answers(tables: Tables, p: np.ndarray) -> list[np.ndarray]:
    found = KERNEL.field(tables, p, 0.2, gradient=True, every=True)
    return [part for part in found if isinstance(part, np.ndarray)]


def scene(name: str) -> Tables:
    return of(compile_scene(load(ROOT / f"examples/{name}.nsg")))[1]


@pytest.mark.parametrize("name", ["bracket", "robot", "teatime", "floor"])
def test_answers_are_those_of_a_point(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same bytes, whatever other points are asked with it, and by processors with AVX2 and AVX-512."""
    tables, rng = scene(name), np.random.default_rng(3)
    p = rng.uniform(-1.5, 1.5, (3, 1003)).astype(np.float32)
    every, order = answers(tables, p), rng.permutation(1003)
    for part, again in zip(every, answers(tables, p[:, order]), strict=True):
        assert part[..., order].tobytes() == again.tobytes()
    newest = KERNEL.variant
    for variant in range(newest):
        monkeypatch.setattr(KERNEL, "variant", variant)
        for part, other in zip(every, answers(tables, p), strict=True):
            if variant and newest:
                assert part.tobytes() == other.tobytes()
        assert abs(answers(tables, p)[0] - every[0]).max() < TOLERANCE


def test_points_that_are_not_numbers_harm_no_others() -> None:
    tables, rng = scene("robot"), np.random.default_rng(4)
    p = rng.uniform(-1, 1, (3, 200)).astype(np.float32)
    every = answers(tables, p)
    bad = np.array([0, 77, 199])
    p[0, bad], p[1, bad[1:]] = np.nan, np.inf
    kept = np.setdiff1d(np.arange(200), bad)
    for part, again in zip(every, answers(tables, p), strict=True):
        assert part[..., kept].tobytes() == again[..., kept].tobytes()


@pytest.mark.parametrize("name", ["bracket", "saturn", "bitten"])
def test_damaged_programs(name: str) -> None:
    """Whatever is in a Program's arrays, it is refused, or answers."""
    program, refused = compile_scene(load(ROOT / f"examples/{name}.nsg")), 0
    for seed in range(60):
        try:
            ask(KERNEL, mutated(program, seed), seed)
        except ProgramError:
            refused += 1
    assert 0 < refused < 60


def test_a_library_of_other_sources_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.drawing.kernel.FOLDER", tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    for text in (None, b"no library"):
        if text is not None:
            (tmp_path / "libkernel.so").write_bytes(text)
            (tmp_path / "libkernel.dll").write_bytes(text)
        with pytest.raises(KernelError, match="pip install ziglang"):
            load_kernel.__wrapped__()
    monkeypatch.setattr("scenelang.drawing.kernel.load_kernel", load_kernel.__wrapped__)
    with pytest.warns(UserWarning, match="pip install ziglang.*torch draws in its place"):
        assert not there_is_a_kernel.__wrapped__()


def test_an_object_alone() -> None:
    """Distances and slopes of single objects, whatever else is there, in any order."""
    program = compile_scene(load(ROOT / "examples/caterpillar.nsg"))
    field, tables = of(program)
    rng = np.random.default_rng(2)
    objects, p = rng.integers(0, len(program), 500), rng.uniform(-1, 1, (3, 500)).astype(np.float32)
    distance, gradient = KERNEL.own(tables, objects, p)
    exact, slope = PlainField(field.network, *field.rows, field.paints).own(objects, p)
    assert distance == pytest.approx(exact, abs=1e-5)
    assert gradient == pytest.approx(slope, abs=1e-3)
