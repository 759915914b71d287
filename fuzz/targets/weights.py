"""Any bytes as the weights of a model."""

from __future__ import annotations

import json
import warnings
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from unittest.mock import patch

import numpy as np
import torch
from safetensors.torch import save

from fuzz import tensors
from fuzz.target import Target, hold
from scenelang.compiler import weights
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import ROOT, load_manifest
from scenelang.compiler.program import ProgramError
from scenelang.compiler.weights import ModelError, codes_of, open_weights, read_facts
from scenelang.drawing.how import RenderError
from scenelang.drawing.neural.load import Framed, Model, load_network
from scenelang.drawing.torch_backend import draw_program
from scenelang.language.evaluation import loads
from scenelang.language.reports import SceneError

MODEL = "shapes2d"
SCENE = """canvas(8, 6);
chain { square { bend(0.3); rotate(20deg); } smooth star { translate(0.2, 0.1); twirl(1); } }"""


def check(data: bytes) -> None:
    """Codes, facts and network, or ModelError; what loads is saved, loaded again and drawn with."""
    manifest = load_manifest(MODEL)
    _facts(data)
    codes = None
    with suppress(ModelError):
        codes = codes_of(manifest, data)
    try:
        network = load_network(data, manifest)
    except ModelError:
        return
    hold(codes is not None, "weights of a network have codes")
    header = open_weights(data).header
    plain = {name: value.contiguous() for name, value in network.state_dict().items()}
    written = save(plain, {"scenelang": json.dumps(header, sort_keys=True)})
    again = load_network(written, manifest)
    for name, value in again.state_dict().items():
        hold(torch.equal(value, plain[name]), "weights to bytes and back", name)
    assert codes is not None
    assert isinstance(network, Framed)
    for mine, theirs in ((network.codes, codes.geometry), (network.material_codes, codes.material)):
        held = list(map(tuple, mine.tolist())) == list(theirs.values())
        hold(held, "codes of the network are those of the file")
    model = Model(manifest, network, codes, header)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            program = compile_scene(loads(SCENE), codes=codes)
            picture = draw_program(program, model, threads=1).image
        except (SceneError, ProgramError, RenderError):
            return
        pixels = picture.to_uint8()
    hold(pixels.shape == (6, 8, 3) and np.isfinite(picture).all(), "a picture of numbers")


def _facts(data: bytes) -> None:
    """What `scenelang models` tells about a file."""
    with patch.object(weights, "read_regular", lambda path, most: data):
        try:
            facts = read_facts(MODEL)
        except ModelError:
            return
    json.dumps(facts)
    hold(facts["bytes"] == len(data), "facts tell the size")


@cache
def _shipped() -> bytes:
    return (ROOT / MODEL / "weights.safetensors").read_bytes()


@cache
def _small() -> bytes:
    """A network of the smallest sizes, so that most of a file is header."""
    from scenelang.drawing.neural.load import Framed
    from scenelang.drawing.neural.network import FramedConfig

    config = FramedConfig(decoder_width=2)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(1)
        network = Framed(config, 4, 1)
    plain = {name: value.detach().contiguous() for name, value in network.state_dict().items()}
    header = {"format": 1, "config": {"network": asdict(config)}, "seed": 1}
    return bytes(save(plain, {"scenelang": json.dumps(header, sort_keys=True)}))


def seeds() -> list[bytes]:
    """A small network and the shipped weights."""
    return [_small(), _shipped(), b"", b"{", b"\0" * 8]


def dictionary() -> list[bytes]:
    """Words of the headers."""
    words = "format config network code decoder_width dtype shape data_offsets F32 F16 __metadata__ scenelang"
    return tensors.quoted(f"{words} codes material_codes")


TARGET = Target(
    name="weights",
    summary="any bytes are the weights of a network or a ModelError; what loads is saved and loaded "
    "unchanged and draws finite numbers",
    check=check,
    seeds=seeds,
    mutate=tensors.mutate,
    dictionary=dictionary,
    most_bytes=32_768,
)
