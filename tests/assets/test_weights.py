"""Weights and checkpoints that mean harm: an error in words, soon and in bounded memory."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from functools import partial
from itertools import product
from random import Random
from typing import Any

import numpy as np
import pytest
from safetensors import SafetensorError
from safetensors.numpy import load, save

from fuzz.tensors import mutate
from scenelang.assets.tensors import TensorError, read_tensors
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import ModelError, codes_of, open_weights, weights_path
from scenelang.drawing.neural.files import framed_arrays
from scenelang.drawing.neural.load import load_network

SHAPES = load_manifest("shapes2d")
DATA = weights_path("shapes2d").read_bytes()


def outer(data: bytes = DATA) -> dict[str, Any]:
    """The safetensors header."""
    (length,) = struct.unpack("<Q", data[:8])
    return json.loads(data[8 : 8 + length])  # type: ignore[no-any-return]


def joined(header: dict[str, Any] | bytes, length: int | None = None) -> bytes:
    """The shipped weights behind another header."""
    (old,) = struct.unpack("<Q", DATA[:8])
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text) if length is None else length) + text + DATA[8 + old :]


def tensor(name: str, **change: Any) -> bytes:
    header = outer()
    header[name] = {**header[name], **change}
    return joined(header)


def arrays(**change: np.ndarray | None) -> bytes:
    """The shipped weights with other tensors, well-formed."""
    kept = {key: value for key, value in {**load(DATA), **change}.items() if value is not None}
    return save(kept, metadata=outer()["__metadata__"])


def network(**change: Any) -> bytes:
    """The shipped weights whose header names other sizes."""
    header = outer()
    told = json.loads(header["__metadata__"]["scenelang"])
    told["config"]["network"].update(change)
    header["__metadata__"]["scenelang"] = json.dumps(told)
    return joined(header)


def twice() -> bytes:
    text = json.dumps(outer()).encode()
    again = json.dumps(outer()["codes"]).encode()
    return joined(text[:-1] + b', "codes": ' + again + b"}")


CODES = load(DATA)["codes"]
HARM = {
    "nothing": b"",
    "a few bytes": b"\0" * 7,
    "a header of 2^63 bytes": joined(outer(), length=1 << 63),
    "a header longer than the file": joined(outer(), length=len(DATA)),
    "a header of 2 MB": joined(b" " * (2 << 20)),
    "deep brackets": joined(b"[" * 500_000),
    "no JSON": joined(b"{]"),
    "not an object": joined(b"[1]"),
    "a key given twice": twice(),
    "overlapping offsets": tensor("codes", data_offsets=outer()["material_codes"]["data_offsets"]),
    "offsets beyond the file": tensor("codes", data_offsets=[0, 1 << 40]),
    "offsets in the wrong order": tensor("codes", data_offsets=[64, 0]),
    "negative offsets": tensor("codes", data_offsets=[-64, 0]),
    "a negative shape": tensor("codes", shape=[-4, -4]),
    "a huge shape": tensor("codes", shape=[1 << 40, 1 << 40]),
    "a shape that overflows": tensor("codes", shape=[1 << 62, 4]),
    "a shape of text": tensor("codes", shape="4, 4"),
    "an unknown type": tensor("codes", dtype="F31"),
    "an offset too many": tensor("codes", data_offsets=[0, 64, 64]),
    "offsets of a shape too large": tensor("codes", shape=[4, 5]),
    "a side of true": tensor("codes", shape=[True, 16]),
    "forty sides": tensor("codes", shape=[4, 4, *[1] * 40]),
    "a tensor with more to say": tensor("codes", strides=[4, 1]),
    "a tensor without a type": joined({**outer(), "codes": {"shape": [4, 4], "data_offsets": [0, 64]}}),
    "a tensor with a name to hide": joined({"\x1b[2J" if k == "codes" else k: v for k, v in outer().items()}),
    "metadata of others": joined({**outer(), "__metadata__": {**outer()["__metadata__"], "format": "pt"}}),
    "no metadata": joined({k: v for k, v in outer().items() if k != "__metadata__"}),
    "metadata that are a list": joined({**outer(), "__metadata__": ["scenelang"]}),
    "metadata that are a number": joined({**outer(), "__metadata__": {"scenelang": 1}}),
    "a header of another format": joined({**outer(), "__metadata__": {"scenelang": '{"format": 2}'}}),
    "a header of format true": joined({**outer(), "__metadata__": {"scenelang": '{"format": true}'}}),
    "a header that says a thing twice": joined(
        {**outer(), "__metadata__": {"scenelang": '{"format": 1, "format": 1}'}}
    ),
    "cut short": DATA[:-100],
    "too long": DATA + b"\0" * 100,
    "no codes": arrays(codes=None),
    "codes of another type": arrays(codes=CODES.astype(np.float64)),
    "codes of too few shapes": arrays(codes=CODES[:3]),
    "codes without rows": arrays(codes=CODES.reshape(-1)),
    "codes a number too long": arrays(codes=np.zeros((4, 5), np.float32)),
    "codes a number too short": arrays(material_codes=np.zeros((1, 11), np.float32)),
    "codes that are not numbers": arrays(codes=np.full_like(CODES, np.nan)),
    "codes without end": arrays(codes=np.full_like(CODES, np.inf)),
}  # fmt: skip
OF_THE_NETWORK = {
    "a parameter that is not a number": arrays(bump=np.full_like(load(DATA)["bump"], np.nan)),
    "a parameter of another type": arrays(bump=load(DATA)["bump"].astype(np.float16)),
    "a parameter too many": arrays(extra=CODES),
    "a parameter too few": arrays(bump=None),
    "a parameter of another shape": arrays(bump=np.zeros((4, 9), np.float32)),
    "a network without a size": network(decoder_width=None),
    "a network of no size": network(decoder_width=0),
    "a network of negative size": network(features=-1),
    "a network of a huge decoder": network(units=1024),
    "a network of a huge cell": network(features=1024, state=1024),
    "a network of true size": network(state=True),
    "a network with a size unknown": network(depth=3),
    "a network of an earlier version": network(cell_width=16),
}


def taken(readers: dict[str, Callable[[bytes], object]], files: dict[str, bytes]) -> list[tuple[str, str]]:
    """The readers that do not refuse a file in words, and its name."""
    wrong = []
    for (reader, read), (name, data) in product(readers.items(), files.items()):
        try:
            read(data)
        except ModelError as error:
            if str(error):
                continue
        wrong.append((reader, name))
    return wrong


def test_harm_is_refused() -> None:
    assert not taken({"codes": lambda data: codes_of(SHAPES, data)}, HARM)
    networks = {"torch": lambda data: load_network(data, SHAPES), "numpy": lambda d: framed_arrays(d, SHAPES)}
    assert not taken(networks, HARM | OF_THE_NETWORK)


def test_the_shipped_weights_are_none_of_these() -> None:
    assert codes_of(SHAPES, DATA).geometry.keys() == set(SHAPES.geometries)
    load_network(arrays(), SHAPES)
    assert open_weights(DATA).header["model"] == "shapes2d"


def test_messages_name_the_place() -> None:
    for name, words in (
        ("a huge shape", "tensor `codes` has no shape"),
        ("codes without end", "tensor `codes` holds numbers that are not finite"),
        ("codes a number too long", "tensor `codes` is float32 [4, 5]; 6 rows of 4 floats are needed"),
        ("offsets of a shape too large", "tensor `codes` is F32 [4, 5], which does not take 96 bytes"),
        ("a key given twice", "the list of tensors: the key `codes` is given twice"),
    ):
        with pytest.raises(ModelError) as caught:
            codes_of(SHAPES, HARM[name])
        assert words in str(caught.value)


@pytest.mark.parametrize("name", ["shapes2d-reading", "shapes2d-streaming-learned"])
@pytest.mark.parametrize(
    "extra", ["codes", "renderer.more", "lifting.more", "lifting.geometry.affine.layers.3.weight"]
)
def test_tensors_that_nothing_asks_for(name: str, extra: str) -> None:
    manifest, data = load_manifest(name), weights_path(name).read_bytes()
    header = open_weights(data).header
    made = save({**load(data), extra: np.zeros(3, np.float32)}, metadata={"scenelang": json.dumps(header)})
    lifting, network = partial(codes_of, manifest, made), partial(load_network, made, manifest)
    with pytest.raises(ModelError):
        (lifting if extra.startswith("lifting") else network)()


def test_what_is_taken_is_what_safetensors_takes() -> None:
    """Files damaged at random are refused, or hold what another reader of them finds."""
    random, count = Random(4), 0
    for _ in range(400):
        data = mutate(DATA, random)
        try:
            found = read_tensors(data, len(DATA) * 2).arrays(finite=False)
        except TensorError:
            continue
        try:
            known = load(data)
        except SafetensorError as error:
            pytest.fail(f"taken, where safetensors says: {error}")
        count += 1
        assert found.keys() == known.keys()
        for key, array in found.items():
            np.testing.assert_array_equal(array, known[key])
    assert 40 < count < 360
