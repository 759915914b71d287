"""Programs in files: round trips, whole or not at all, and files that mean harm."""

from __future__ import annotations

import json
import random
import struct
from pathlib import Path

import numpy as np
import pytest

from scenelang.compiler.program import ProgramError, load_program, parse_program, program_bytes
from tests.compiler.test_program_compile import CHAIN, compiled


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
    path = tmp_path / "chain.safetensors"
    chain.save(path)
    again = load_program(path)
    for name in ("vectors", "tokens", "bounds"):
        assert np.array_equal(getattr(again, name), getattr(chain, name))
    for name in ("canvas", "background", "model", "weights", "objects", "places"):
        assert getattr(again, name) == getattr(chain, name)
    assert again.digest() == chain.digest()
    assert program_bytes(again) == path.read_bytes() == program_bytes(compiled(CHAIN)[0])


@pytest.mark.parametrize("text", ["", "background(none); canvas(17, 5); star { }"])
def test_round_trip_of_small_ones(text: str, tmp_path: Path) -> None:
    program = compiled(text)[0]
    program.save(tmp_path / "p")
    assert load_program(tmp_path / "p").digest() == program.digest()


def test_a_failed_write_leaves_what_was_there(chain, tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "p.safetensors"
    path.write_bytes(b"before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        chain.save(path)
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]


def test_other_weights(chain, tmp_path: Path) -> None:
    outer, body = parts(program_bytes(chain))
    header = json.loads(outer["__metadata__"]["scenelang"])
    for change, words in (
        ({"weights": "a" * 64}, "compile the scene again"),
        ({"model": "x"}, "unknown model"),
    ):
        outer["__metadata__"]["scenelang"] = json.dumps({**header, **change})
        (tmp_path / "p").write_bytes(joined(outer, body))
        with pytest.raises(ProgramError, match=words):
            load_program(tmp_path / "p")
    outer["__metadata__"]["scenelang"] = json.dumps({**header, "weights": "a" * 64})
    (tmp_path / "p").write_bytes(joined(outer, body))
    assert load_program(tmp_path / "p", weights="a" * 64).weights == "a" * 64


HEADERS = [
    {"format": 2},
    {"canvas": [0, 8]},
    {"canvas": [8, 8, 8]},
    {"canvas": "8x8"},
    {"canvas": [1e9, 8]},
    {"canvas": [True, 8]},
    {"background": [1, 2]},
    {"background": "red"},
    {"background": [1, None, 3]},
    {"model": 7},
    {"weights": None},
    {"geometries": []},
    {"geometries": [1, 2, 3]},
    {"files": []},
    {"files": {}},
    {"extra": 1},
]


@pytest.mark.parametrize("change", HEADERS, ids=str)
def test_bad_headers(chain, change: dict) -> None:
    outer, body = parts(program_bytes(chain))
    header = json.loads(outer["__metadata__"]["scenelang"])
    outer["__metadata__"]["scenelang"] = json.dumps({**header, **change})
    with pytest.raises(ProgramError):
        parse_program(joined(outer, body))


def changed(outer: dict, name: str, **entry) -> dict:
    return {**outer, name: {**outer[name], **entry}}


def test_bad_layouts(chain) -> None:
    data = program_bytes(chain)
    outer, body = parts(data)
    cases = [
        b"",
        b"short",
        data[:-1],
        data + b"x",
        struct.pack("<Q", 1 << 62) + data[8:],
        joined(b"[" * 100_000, body),
        joined(b"[1, 2]", body),
        joined(b"\xff\xfe", body),
        joined({**outer, "more": outer["tokens"]}, body),
        joined({k: v for k, v in outer.items() if k != "tokens"}, body),
        joined({k: v for k, v in outer.items() if k != "__metadata__"}, body),
        joined({**outer, "__metadata__": {"scenelang": "[" * 50_000}}, body),
        joined({**outer, "__metadata__": {"scenelang": "\\ud800"}}, body),
        joined({**outer, "tokens": None}, body),
        joined(changed(outer, "tokens", dtype="F32"), body),
        joined(changed(outer, "vectors", dtype="F64"), body),
        joined(changed(outer, "vectors", shape=[4, 32]), body),
        joined(changed(outer, "vectors", shape=[10**9, 64]), body),
        joined(changed(outer, "tokens", shape=[-1]), body),
        joined(changed(outer, "tokens", shape=[]), body),
        joined(changed(outer, "tokens", shape=[4.0]), body),
        joined(changed(outer, "tokens", data_offsets=[0, 1 << 40]), body),
    ]
    for case in cases:
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
    for _ in range(1500):
        harmed = bytearray(data)
        for _ in range(rng.choice([1, 1, 3])):
            # most of the damage to the headers, where it is hardest to bear
            at = rng.randrange(8 + 1000) if rng.random() < 0.8 else rng.randrange(len(data))
            harmed[at] = rng.randrange(256)
        try:
            parse_program(bytes(harmed))
        except ProgramError:
            refused += 1
    assert refused > 500
