"""Scene to Program, and Programs in files: rows, bounds, round trips, files that mean harm."""

from __future__ import annotations

import json
import random
import struct
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.lifting import PLANE_LAYOUT
from scenelang.compiler.passes import OPTIONAL
from scenelang.compiler.program import (
    Place,
    Program,
    ProgramError,
    load_program,
    parse_program,
    program_bytes,
)
from scenelang.compiler.weights import load_codes
from scenelang.language import scene as schema
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.reports import SceneError
from tests.assets.scenes import retyped

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


HARMED = {
    "vectors": (
        np.zeros((2, 63), np.float32),
        np.zeros((2, 64), np.float64),
        np.full((2, 64), np.nan, np.float32),
        np.full((2, 64), np.inf, np.float32),
        [[0.0] * 64] * 2,
    ),
    "tokens": (
        *(np.array(tokens, np.int8) for tokens in ([0, 7], [0, -1], [1, 1])),
        np.array([0, 1], np.int64),
    ),
    "bounds": (np.array([[1, 1, -1, -1]] * 2, np.float32), np.full((2, 4), np.nan, np.float32)),
    "canvas": ((0, 8), (8193, 8), (8.0, 8), (8,)),
    "background": (
        (1.0, 2.0),
        (1.0, 1.0, float("nan")),
        (0, 0, 10**400),
        (-1e308, 0, 0),
        (0.5, 1.0000001, 0),
    ),
    "model": ("",),
    "weights": ("xyz",),
    "objects": (("star",),),
    "places": ((None,),),
}


def test_what_is_no_program() -> None:
    program = compiled("star { scale(0.5); } pentagon { scale(0.2); }")[0]
    for name, values in HARMED.items():
        for value in values:
            with pytest.raises(ProgramError):
                replace(program, **{name: value})


def test_programs_cannot_be_changed() -> None:
    vectors = np.zeros((1, 64), np.float32)
    program = replace(compiled("star { }")[0], vectors=vectors)
    vectors[:] = 5
    assert not program.vectors.any()
    with pytest.raises(ValueError, match="read-only"):
        program.vectors[:] = 1


@pytest.fixture(scope="module")
def chain():
    return compiled(CHAIN)[0]


def parts(data: bytes) -> tuple[dict, bytes]:
    (length,) = struct.unpack("<Q", data[:8])
    return json.loads(data[8 : 8 + length]), data[8 + length :]


def joined(outer, body: bytes) -> bytes:
    text = outer if isinstance(outer, bytes) else json.dumps(outer).encode()
    return struct.pack("<Q", len(text)) + text + body


def test_round_trip(chain, tmp_path: Path) -> None:
    for program in (chain, compiled("")[0], compiled("background(none); canvas(17, 5); star { }")[0]):
        path = tmp_path / "p.safetensors"
        program.save(path)
        again = load_program(path)
        for name in ("vectors", "tokens", "bounds"):
            assert np.array_equal(getattr(again, name), getattr(program, name))
        for name in ("canvas", "background", "model", "weights", "objects", "places"):
            assert getattr(again, name) == getattr(program, name)
        assert again.digest() == program.digest()
        assert program_bytes(again) == path.read_bytes() == program_bytes(program)


def test_other_weights(chain, tmp_path: Path) -> None:
    outer, body = parts(program_bytes(chain))
    header = json.loads(outer["__metadata__"]["scenelang"])
    path = tmp_path / "p"
    for change, words in (
        ({"model": "x"}, "unknown model"),
        ({"weights": "a" * 64}, "compile the scene again"),
    ):
        outer["__metadata__"]["scenelang"] = json.dumps({**header, **change})
        path.write_bytes(joined(outer, body))
        with pytest.raises(ProgramError, match=words):
            load_program(path)
    assert load_program(path, weights="a" * 64).weights == "a" * 64


HEADERS = {
    "format": (2,),
    "canvas": ([0, 8], [8, 8, 8], "8x8", [1e9, 8], [True, 8]),
    "background": ([1, 2], "red", [1, None, 3]),
    "model": (7,),
    "weights": (None,),
    "geometries": ([], [1, 2, 3]),
    "files": ([], {}),
    "extra": (1,),
}


def test_bad_headers(chain) -> None:
    outer, body = parts(program_bytes(chain))
    header = json.loads(outer["__metadata__"]["scenelang"])
    for key, values in HEADERS.items():
        for value in values:
            outer["__metadata__"]["scenelang"] = json.dumps({**header, key: value})
            with pytest.raises(ProgramError):
                parse_program(joined(outer, body))


def test_headers_of_other_types_are_refused_or_read() -> None:
    lit, _ = compiled("sky(); camera(); light(); light(radius = 0.1); sphere;")
    outer, body = parts(program_bytes(lit))
    read = 0
    for header in retyped(json.loads(outer["__metadata__"]["scenelang"])):
        outer["__metadata__"]["scenelang"] = json.dumps(header)
        with suppress(ProgramError):
            read += len(parse_program(joined(outer, body)))
    assert read > 20


def test_bad_layouts(chain) -> None:
    """The reader is that of weights, whose tests have more of them."""
    data = program_bytes(chain)
    outer, body = parts(data)
    for case in (
        b"",
        data[:-1],
        data + b"x",
        joined(b"[" * 100_000, body),
        joined({**outer, "more": outer["tokens"]}, body),
        joined({k: v for k, v in outer.items() if k != "tokens"}, body),
        joined({k: v for k, v in outer.items() if k != "__metadata__"}, body),
        joined({**outer, "__metadata__": {"scenelang": "[" * 50_000}}, body),
        joined({**outer, "__metadata__": {"scenelang": "\\ud800"}}, body),
        joined({**outer, "vectors": {**outer["vectors"], "shape": [4, 32]}}, body),
        joined({**outer, "tokens": {**outer["tokens"], "dtype": "F32"}}, body),
    ):
        with pytest.raises(ProgramError):
            parse_program(case)


def test_bad_numbers(chain) -> None:
    outer, body = parts(program_bytes(chain))
    for name, at, value in (
        ("vectors", 40, struct.pack("<f", float("nan"))),
        ("tokens", 1, b"\x07"),
        ("tokens", 0, b"\x01"),
        ("objects", 0, struct.pack("<i", 9)),
        ("objects", 0, struct.pack("<i", -1)),
        ("places", 0, struct.pack("<i", 5)),
        ("places", 4, struct.pack("<i", 0)),
    ):
        start = outer[name]["data_offsets"][0] + at
        harmed = body[:start] + value + body[start + len(value) :]
        with pytest.raises(ProgramError):
            parse_program(joined(outer, harmed))


def test_random_damage_is_an_error_or_a_program(chain) -> None:
    data = program_bytes(chain)
    rng = random.Random(10)
    refused = 0
    for _ in range(600):
        harmed = bytearray(data)
        for _ in range(rng.choice([1, 1, 3])):
            # most of the damage to the headers, where it is hardest to bear
            at = rng.randrange(8 + 1000) if rng.random() < 0.8 else rng.randrange(len(data))
            harmed[at] = rng.randrange(256)
        try:
            parse_program(bytes(harmed))
        except ProgramError:
            refused += 1
    assert refused > 200
