"""Scene to Program: rows, tokens, bounds, source map, determinism, warnings and what is imported."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.lifting import PLANE_LAYOUT
from scenelang.compiler.passes import OPTIONAL
from scenelang.compiler.program import Place, Program, ProgramError
from scenelang.compiler.weights import load_codes
from scenelang.language import scene as schema
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.reports import SceneError

CHAIN = """chain {
  square { scale(0.8); translate(-0.2, 0); material flat { color(#d33); } }
  smooth pentagon { twirl(0.6); bend(0.2); scale(0.5); rotate(30deg); }
  subtract star { scale(0.3); translate(0.1, 0.1); }
  intersect square { rotate(45deg); }
}
"""


def compiled(text: str, **options) -> tuple[Program, Diagnostics]:
    diagnostics = Diagnostics()
    scene, spans = Source(text=SourceFile("a.nsg", text)).scene(diagnostics)
    assert scene is not None, list(diagnostics)
    return compile_scene(scene, spans=spans, diagnostics=diagnostics, **options), diagnostics


def test_a_chain_is_four_rows() -> None:
    program, diagnostics = compiled(CHAIN)
    assert not diagnostics.items
    assert program.objects == ("square", "pentagon", "star", "square")
    assert program.tokens.tolist() == [0, 1, 2, 3]
    assert program.vectors.shape == (4, 64)
    assert program.vectors.dtype == np.float32
    assert (program.canvas, program.background, program.model) == ((256, 256), (1, 1, 1), "shapes2d")
    assert program.weights == load_codes("shapes2d").digest
    assert program.places[1] == Place("a.nsg", 3, 10, 3, 18)
    frame = program.vectors[0, PLANE_LAYOUT.places.frame].reshape(2, 3)
    assert frame == pytest.approx(np.array([[1.25, 0, 0.25], [0, 1.25, 0]]))


def test_an_empty_scene_has_no_rows() -> None:
    program = compile_scene(schema.Scene(background=None, canvas=(10, 20)))
    assert len(program) == 0
    assert (program.canvas, program.background) == ((10, 20), None)
    assert program.bounds.shape == (0, 4)


def test_bounds_are_where_a_row_matters() -> None:
    program, _ = compiled(
        "canvas(300, 200); chain { square { scale(0.2); } union square { scale(0.1); translate(0.5, 0); }"
        " smooth square { scale(0.1); } subtract star { scale(0.1); translate(0.1, 0); }"
        " intersect square { scale(0.9); } }"
    )
    h = 0.5**0.5
    base, union, smooth, cut, clip = program.bounds.tolist()
    # one `smooth` is still to come: it feels a leaf within k = 0.15 of it
    assert base == pytest.approx([-0.2 * h - 0.15, -0.2 * h - 0.15, 0.2 * h + 0.15, 0.2 * h + 0.15], abs=1e-6)
    assert union[0] == pytest.approx(0.5 - 0.1 * h - 0.15, abs=1e-6)
    assert smooth[2] == pytest.approx(0.1 * h + 0.15, abs=1e-6)
    assert cut[3] == pytest.approx(0.1, abs=1e-6)
    assert clip == [-1.5, -1, 1.5, 1]


def test_rows_off_the_canvas_are_not_there() -> None:
    off = "square { scale(0.2); translate(5, 0); }"
    on = "star { scale(0.5); }"
    assert compiled(off + on)[0].objects == ("star",)
    assert compiled(f"subtract {{ {on} {off} }}")[0].objects == ("star",)
    assert compiled(f"subtract {{ {off} {on} }}")[0].objects == ()
    assert compiled(f"intersect {{ {on} {off} }}")[0].objects == ()
    assert compiled(f"chain {{ {on} intersect {off} {on} smooth {off} }}")[0].objects == ("star",)
    assert compiled(f"canvas(2048, 256); {on} {off}")[0].objects == ("star", "square")


def test_passes_that_only_save_work_can_be_left_out() -> None:
    text = "square { scale(2); } star { scale(0.2); } pentagon { translate(5, 0); } square { scale(3); }"
    assert compiled(text)[0].objects == ("square",)
    assert compiled(text, without=OPTIONAL)[0].objects == ("square", "star", "pentagon", "square")
    with pytest.raises(ValueError, match="flatten"):
        compiled(text, without={"flatten"})


def test_the_same_scene_gives_the_same_program() -> None:
    first, second = compiled(CHAIN)[0], compiled(CHAIN)[0]
    assert first.digest() == second.digest()
    assert compiled(CHAIN.replace("#d33", "#d34"))[0].digest() != first.digest()
    assert compiled("// moved\n" + CHAIN)[0].digest() == first.digest()
    nested = compiled(f"group {{ group {{ {CHAIN} }} }}")[0]
    assert nested.digest() == first.digest()


def test_a_group_deformed_and_scaled_too_often() -> None:
    def group(text: str, times: int) -> str:
        for _ in range(times):
            text = f"group {{ {text} bend(0.1); scale(0.9, 0.8); }}"
        return text

    assert len(compiled(group("star { }", 2))[0]) == 1
    with pytest.raises(SceneError) as caught:
        compiled(group("star { }", 3))
    (error,) = [d for d in caught.value.diagnostics if d.severity == "error"]
    assert error.code == "E0506"
    assert "`star`" in error.message
    assert error.labels
    # twirls across similarities are one, however many
    deep = "star { scale(0.2); }"
    for _ in range(60):
        deep = f"group {{ {deep} twirl(0.01); rotate(10deg); scale(1.01); }}"
    assert len(compiled(deep)[0]) == 1


def test_transforms_that_compose_to_a_singular_one() -> None:
    with pytest.raises(SceneError) as caught:
        compiled("group { group { square { scale(1, 1e-7); } scale(1, 1e-7); } }")
    assert [d.code for d in caught.value.diagnostics if d.severity == "error"] == ["E0406"]


def test_models() -> None:
    scene = schema.Scene(nodes=(schema.Object("star"),))
    assert compile_scene(scene, model="shapes2d").model == "shapes2d"
    with pytest.raises(SceneError) as caught:
        compile_scene(scene, model="nosuch")
    assert caught.value.diagnostics[0].code == "E0514"


def test_compiling_loads_no_torch_and_checking_no_numpy() -> None:
    code = (
        "import sys, scenelang as nsg\n"
        "from scenelang.compiler.passes import check_scene\n"
        "from scenelang.compiler.manifest import load_manifest\n"
        "scene = nsg.Scene(nodes=(nsg.Object('star'),))\n"
        "check_scene(scene, None, nsg.Diagnostics(), load_manifest('shapes2d'))\n"
        "assert not {'numpy', 'torch'} & set(sys.modules)\n"
        "nsg.compile(scene)\n"
        "assert 'torch' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def program_of(**changes) -> Program:
    parts = {
        "vectors": np.zeros((2, 64), np.float32),
        "tokens": np.array([0, 2], np.int8),
        "bounds": np.tile(np.array([-1, -1, 1, 1], np.float32), (2, 1)),
        "canvas": (8, 8),
        "background": None,
        "model": "shapes2d",
        "weights": "0" * 64,
        "objects": ("star", "star"),
        "places": (None, None),
    }
    return Program(**{**parts, **changes})


@pytest.mark.parametrize(
    "changes",
    [
        {"vectors": np.zeros((2, 63), np.float32)},
        {"vectors": np.zeros((2, 64), np.float64)},
        {"vectors": np.full((2, 64), np.nan, np.float32)},
        {"vectors": np.full((2, 64), np.inf, np.float32)},
        {"vectors": [[0.0] * 64] * 2},
        {"tokens": np.array([0, 7], np.int8)},
        {"tokens": np.array([0, -1], np.int8)},
        {"tokens": np.array([1, 1], np.int8)},
        {"tokens": np.array([0, 1], np.int64)},
        {"bounds": np.array([[1, 1, -1, -1]] * 2, np.float32)},
        {"bounds": np.full((2, 4), np.nan, np.float32)},
        {"canvas": (0, 8)},
        {"canvas": (8193, 8)},
        {"canvas": (8.0, 8)},
        {"canvas": (8,)},
        {"background": (1.0, 2.0)},
        {"background": (1.0, 1.0, float("nan"))},
        {"model": ""},
        {"weights": "xyz"},
        {"objects": ("star",)},
        {"places": (None,)},
    ],
)
def test_what_is_no_program(changes) -> None:
    program_of()
    with pytest.raises(ProgramError):
        program_of(**changes)


def test_programs_cannot_be_changed() -> None:
    vectors = np.zeros((2, 64), np.float32)
    program = program_of(vectors=vectors)
    vectors[:] = 5
    assert not program.vectors.any()
    with pytest.raises(ValueError, match="read-only"):
        program.vectors[:] = 1
