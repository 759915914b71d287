"""The kernel for GPUs: on one where there is one, else by Triton's interpreter."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from scenelang.assets.element_file import ElementFile
from scenelang.compiler.groups import read_groups
from scenelang.compiler.program import Paint, Program
from scenelang.drawing import torch_backend
from scenelang.drawing.neural.coverage import Coverage
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.load import load_model
from scenelang.drawing.neural.meetings import raster
from tests.assets.shapes import element, noise, square
from tests.drawing.copies import Asked
from tests.drawing.test_field import SCENES
from tests.drawing.test_renderers_textures import at_random, dressed
from tests.pictures import premultiplied

torch = pytest.importorskip("torch")
HERE = "cuda" if torch.cuda.is_available() else "cpu"
os.environ["TRITON_INTERPRET"] = "01"[HERE == "cpu"]  # is read when Triton is imported
pytest.importorskip("triton")
from scenelang.drawing.neural import device

EQUAL = 1 / 255
"""Of a channel; by the interpreter none is off by more than 0.0001."""


def network(model: str = "shapes2d"):
    return load_model(model, HERE).framed


def program(scene: nsg.Scene | str, canvas: tuple[int, int] = (20, 12), **changes: object) -> Program:
    scene = nsg.loads(scene) if isinstance(scene, str) else scene
    return nsg.compile(scene.model_copy(update={"canvas": canvas, **changes}))


def assert_draws(p: Program, samples: str = "adaptive", contrast: float = 0.2) -> None:
    """What numpy draws with as many samples."""
    found = device.draw_on_device(network(p.model), p, samples)
    usual = draw_objects(
        load_arrays(p.model).network, p, samples="four" if samples == "adaptive" else samples
    )
    assert found is not None
    assert found.image.shape == usual.image.shape
    assert np.ptp(usual.image) >= contrast
    np.testing.assert_allclose(premultiplied(found.image), premultiplied(usual.image), rtol=0, atol=EQUAL)


def evaluated(name: str, seed: int) -> nsg.Scene:
    """A scene of an evaluation set."""
    return random_scene(np.random.default_rng([7, seed]), SETS[name])


def test_draws_any_tree() -> None:
    """Groups of several depths, and cuts that round their edges."""
    depths = set()
    for seed in (3, 8):
        p = program(evaluated("trees", seed), (24, 12))
        depths.add(read_groups(p.tokens).deepest)
        assert_draws(p, contrast=0.0)
    assert max(depths) > 1


def test_draws_what_numpy_draws() -> None:
    """Cuts, blends and warps; evaluation sets; textures; decoders narrower than a product."""
    for name in ("subtract", "intersect", "smooth after a cut", "deformed", "thin"):
        assert_draws(program(SCENES[name], background=None))
    for name in ("chains", "textures2d-mixed"):
        assert_draws(program(evaluated(name, 1), (33, 17)))
    for samples in ("one", "draft"):
        assert_draws(program(SCENES["unions"], (24, 20)), samples)
    for name, seed in (("unions", 0), ("deformed blends", 2), ("subtract", 3)):
        assert_draws(at_random(program(SCENES[name]), seed))
    assert_draws(nsg.compile(nsg.loads(SCENES["deformed"]).sized((16, 16)), model="shapes2d-w8"))


def test_draws_elements() -> None:
    """Inside and beyond their grids, which are coarse enough to be told from the shape."""
    square_of_eight = element(square, "made", cells=4, levels=2, d=2)
    zoo = nsg.Elements.of("zoo", "z", ElementFile({"made": square_of_eight}, "0" * 64))
    objects = [
        nsg.Object("zoo.made", [nsg.Scale(0.7, 0.5), nsg.Rotate.degrees(20)]),
        nsg.Object("star", [nsg.Scale(0.4), nsg.Translate(0.5, 0.3)]),
    ]
    blend = nsg.Boolean("smooth", objects, k=1.2)  # so wide that what lies beyond the grid shows
    assert_draws(program(nsg.Scene(elements=zoo, nodes=[blend]), background=None))


def test_colours_are_clamped_after_each_step() -> None:
    steps = ("color", 3.0, 1.5, 0.2), ("grayscale", 0.5)
    assert_draws(dressed(program("square { scale(0.8); }"), [Paint(noise(7, 5), steps)]))


def test_nothing_to_draw() -> None:
    p = program("canvas(9, 9); background(#204060); star { translate(9, 9); }", (9, 9))
    found = device.draw_on_device(network(), p)
    assert found is not None
    np.testing.assert_allclose(
        found.image, np.broadcast_to(np.array([32, 64, 96]) / 255, (9, 9, 3)), atol=1e-6
    )


def test_leaves_what_it_does_not_know() -> None:
    wild = program("star { scale(3e9); } square { scale(0.3); }")
    assert device.draw_on_device(network(), wild) is None
    for change in ({"state": 2}, {"features": 2}, {"decoder_width": 33}):
        net = network()
        net.config = dataclasses.replace(net.config, **change)
        assert device.draw_on_device(net, program(SCENES["unions"])) is None


def test_changed_weights_are_fetched_again() -> None:
    p = program(SCENES["unions"], (8, 8))
    with torch.inference_mode():  # torch keeps no versions of such weights
        assert np.ptp(device.draw_on_device(network(), p).image) > 0.2
    net = network()
    before = device.draw_on_device(net, p)
    with torch.no_grad():
        net.albedo += 0.5
    after = device.draw_on_device(net, p)
    assert abs(after.image - before.image).max() > 0.1


def begun(p: Program, like: object = None) -> object:
    """A frame on a device, by default on one whose tensors have no numbers: whoever waits for one fails."""
    field = Field(load_arrays("shapes2d").network, p.vectors, p.tokens)
    grid = raster(p.canvas, range(p.canvas[1]))
    like = torch.empty(0, device="meta") if like is None else like
    return device.start(field, grid, Coverage(field).candidates(grid), p.background, 4, like)


def test_a_frame_waits_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """One copy up, one launch, and a picture that is on its way."""
    launched = []
    monkeypatch.setattr(device, "launch", lambda *a, **k: launched.append(a))
    with Asked() as asked, torch.device("meta"):  # whatever device others have made the default
        out = begun(program(SCENES["small"]))
    assert out.device.type == "meta"
    assert len(launched) == 1
    assert asked.seen["upload"] == 1
    assert set(asked.seen) <= {"upload", "empty", "new_empty", "slice", "view", "detach"}


def test_render_takes_the_kernel_where_the_network_lies_on_a_gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    launched, share = [], []
    launch = device.launch
    monkeypatch.setattr(device, "launch", lambda *a, **k: (launched.append(a), launch(*a, **k)))
    monkeypatch.setattr(torch_backend, "place_of", lambda _: SimpleNamespace(type="cuda"))
    monkeypatch.setattr(device, "ready", lambda: True)
    p, model = program(SCENES["unions"]), load_model("shapes2d", HERE)
    found = torch_backend.draw_program(p, model, progress=share.append)
    assert (len(launched), share) == (1, [1.0])
    torch_backend.draw_program(p, model, skip=False)
    monkeypatch.setattr(device, "ready", lambda: False)
    torch_backend.draw_program(p, model)
    assert len(launched) == 1
    np.testing.assert_allclose(
        found.image, torch_backend.draw_program(p, model, samples="four").image, atol=1e-6
    )


@pytest.mark.parametrize(
    "failure", [RuntimeError, ImportError, subprocess.CalledProcessError(1, "gcc"), None]
)
def test_is_ready_where_triton_can_start_kernels(monkeypatch: pytest.MonkeyPatch, failure) -> None:
    """That is with a driver, which Triton builds with a C compiler."""
    driver = mock.Mock(get_current_target=mock.Mock(side_effect=failure))
    monkeypatch.setattr(device.triton.runtime, "driver", SimpleNamespace(active=driver))
    assert device.ready.__wrapped__() == (failure is None)


COMPILE = """
import sys
from triton import compile
from triton.backends.compiler import GPUTarget
from triton.compiler import ASTSource
from scenelang.drawing.neural.device import draw_blocks
INTEGERS, POINTERS = ("width", "height", "across"), ("starts", "objects", "levels", "parts")
NUMBERS = ("left", "top", "px", "empty", "slope")
types = {n: "constexpr" if n.isupper() else "i32" if n in INTEGERS else "fp32" if n in NUMBERS
         else "*i32" if n in POINTERS else "*fp32" for n in draw_blocks.arg_names}
sizes = dict(SIDE=8, ROW=42, OUTER=3, INNER=2, CELL=31, LINES=2, LEAVES=9, **eval(sys.argv[2]))
built = compile(ASTSource(draw_blocks, types, sizes), target=GPUTarget("cuda", int(sys.argv[1]), 32),
                options={"num_warps": 8})
print(len(built.asm["cubin"]), built.metadata.shared)
"""


LARGE = {"SAMPLES": 4, "CHANNELS": 3, "WIDTH": 32, "LEVELS": 1}
SMALL = {"SAMPLES": 1, "CHANNELS": 4, "WIDTH": 16, "LEVELS": 1}
NESTED = {**LARGE, "LEVELS": 4}
RARE = (75, LARGE), (90, LARGE), (90, SMALL), (100, LARGE)
SLOW = [pytest.param(*row, marks=pytest.mark.slow) for row in RARE]


@pytest.mark.parametrize(("generation", "sizes"), [(90, NESTED), *SLOW])
def test_compiles_for_gpus_that_are_not_here(generation: int, sizes: dict[str, int], tmp_path: Path) -> None:
    """To their machine code, by the assembler that Triton brings, and there is room for it."""
    command = [sys.executable, "-c", COMPILE, str(generation), repr(sizes)]
    environment = {**os.environ, "TRITON_INTERPRET": "0", "TRITON_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    code, shared = map(int, done.stdout.split())
    assert 10_000 < code < 500_000, "loops unrolled over warps make it ten times as long, and registers spill"
    assert shared < 48 << 10


@pytest.mark.gpu
def test_cuda_waits_for_nothing() -> None:
    """CUDA's own check, from the upload to the launch."""
    p, net = program(SCENES["small"], (256, 256)), network()
    device.draw_on_device(net, p)  # compiles
    torch.cuda.set_sync_debug_mode("error")
    try:
        begun(p, net.codes)
    finally:
        torch.cuda.set_sync_debug_mode("default")


@pytest.mark.gpu
@pytest.mark.parametrize("name", SETS)
def test_cuda_draws_evaluation_sets(name: str) -> None:
    for seed in range(4):
        scene = evaluated(name, seed)
        assert_draws(program(scene, scene.canvas))


@pytest.mark.gpu
@pytest.mark.parametrize("material", ["diffuse", "volumetric"])
def test_cuda_draws_solids(material: str) -> None:
    scene = nsg.loads(f"canvas(96, 64); sphere {{ material {material}; }} torus {{ translate(1, 0, 0); }}")
    found = [nsg.render(scene, device=where) for where in ("cuda", "auto")]
    np.testing.assert_allclose(*found, rtol=0, atol=2 / 255)
