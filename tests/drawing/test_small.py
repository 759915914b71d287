"""Pictures drawn by numpy are torch's, the Program alone chooses the library; samples of a pixel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program
from scenelang.compiler.weights import Codes
from scenelang.drawing.how import How, RenderError, Samples
from scenelang.drawing.image import enlarged
from scenelang.drawing.neural.load import Model
from scenelang.drawing.neural.paper import Streaming, StreamingConfig
from scenelang.drawing.small import choose_drawer, draw_small
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.drawing.work import work_ms
from scenelang.language.evaluation import Source
from scenelang.output.frames import Clip
from scenelang.output.painting import Painter

ROOT = Path(__file__).parents[2]
EXAMPLES = (
    *("bracket", "chart", "deformations", "die", "icecream", "lantern", "letters", "saturn", "stones"),
    *("teatime", "tree", "turned", "venn"),
)
STEP = 1 / 255
STAR = "star { scale(0.4); twirl(1); }"
CLOUD = "smooth { for (i in 0..<400) { star { scale(0.9); rotate(1turn * rand(i)); } } }"


def program(text: str, **changes: object) -> Program:
    return compile_scene(nsg.loads(text).model_copy(update=changes))


def assert_same(p: Program, **options: str) -> None:
    """The two libraries' pictures, as they go into files too; in the plane torch takes all samples.

    Of solids a pixel in 2,000 may just be sampled four times by one library and not by the other.
    """
    if p.stage is None and options.get("samples") != "one":
        options["samples"] = "four"
    by_torch = draw_program(p, open_model(p.model), threads=1, **options).image  # type: ignore[arg-type]
    by_numpy = draw_small(p, **options).image  # type: ignore[arg-type]
    assert by_numpy.dtype == by_torch.dtype
    assert by_numpy.shape == by_torch.shape
    steps, apart = (1, 0) if p.stage is None else (2, 1 + by_torch[..., 0].size // 2000)
    assert (np.abs(by_numpy - by_torch).max(2) > steps * STEP).sum() <= apart
    levels = np.abs(by_numpy.to_uint8().astype(int) - by_torch.to_uint8())
    assert (levels.max(2) > steps).sum() <= apart


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_look_the_same(name: str) -> None:
    """Programs of every kind; light of a sky is the kernel's alone."""
    scene = nsg.load(ROOT / f"examples/{name}.nsg")
    assert_same(compile_scene(scene.model_copy(update={"canvas": (26, 19)})))


def test_odd_scenes_look_the_same() -> None:
    texts = "", "background(none);", "star { scale(3e9); }", "star { scale(1, 1e-3); rotate(1rad); }"
    for text in (*texts, f"smooth {{ {STAR} {STAR} }}"):
        assert_same(compile_scene(nsg.loads("canvas(37, 300);" + text)))


def test_the_kernel_draws_whatever_it_takes() -> None:
    small, wide, many = program(STAR), program(STAR, canvas=(8000, 6000)), program(CLOUD)
    assert {choose_drawer(p) for p in (small, wide, many)} == {("numpy", "the kernel")}
    assert work_ms(small, "one") < work_ms(small) < work_ms(program(STAR, canvas=(512, 512)))
    assert work_ms(wide, "four") > work_ms(wide)


def test_a_named_device_is_torch_s() -> None:
    small = program(STAR)
    assert choose_drawer(small, "cpu") == ("torch", "asked for by device cpu")
    assert choose_drawer(small, "cuda")[0] == "torch"
    assert np.array_equal(
        nsg.render(small, device="cpu", threads=1),
        draw_program(small, open_model("shapes2d"), threads=1).image,
    )


def test_networks_of_whole_pictures_are_torch_s() -> None:
    scene = nsg.loads("canvas(64, 64); star;")
    assert choose_drawer(compile_scene(scene, model="shapes2d-streaming"))[0] == "torch"
    with pytest.raises(RenderError, match="unknown model `none`"):
        choose_drawer(replace(program(STAR), model="none"))


def test_a_frame_is_a_picture(tmp_path: Path) -> None:
    path = tmp_path / "a.nsg"
    path.write_text("canvas(48, 48);" + STAR)
    painter, other = (Painter(Clip(Source(path)), How(threads=1, device=d)) for d in ("auto", "cpu"))
    frame, by_torch = painter.prepare(painter.clip.shot(0)), other.prepare(other.clip.shot(0))
    assert frame.key != by_torch.key
    assert [frame.place, by_torch.place] == ["numpy", "cpu"]
    assert np.array_equal(painter.draw(frame), draw_small(frame.program).image)  # type: ignore[arg-type]


def test_sampling_is_counted() -> None:
    p = program(STAR, canvas=(64, 64), background=(0, 0, 0))
    drawn = {s: draw_small(p, threads=1, samples=s) for s in get_args(Samples) if isinstance(s, str)}
    assert drawn["one"].refined == 0
    assert 0 < drawn["four"].refined == drawn["four"].met < 64 * 64  # the others have one colour
    assert 0 < drawn["adaptive"].refined < 64 * 64 / 4
    assert drawn["one"].pairs < drawn["adaptive"].pairs < drawn["four"].pairs
    assert np.array_equal(drawn["quick"].image, drawn["adaptive"].image)  # the plane knows no quicker way
    scene = nsg.loads(f"canvas(64, 64); {STAR}")
    half = nsg.render(scene, samples="one", size=(32, 32))
    assert np.array_equal(nsg.render(scene, samples="draft"), enlarged(half, (64, 64)))


def test_ways_to_sample_that_are_refused() -> None:
    scene = nsg.loads(f"canvas(16, 16); background(#fff); {STAR}")
    with pytest.raises(ValueError, match="unknown samples `two`; there are `adaptive`, `four`, `quick`, "):
        nsg.render(scene, samples="two")  # type: ignore[arg-type]
    with pytest.raises(RenderError, match="the reference always takes all samples of a pixel"):
        nsg.render(scene, backend="reference", samples="one")
    manifest = load_manifest("shapes2d")
    manifest = replace(manifest, name="small", renderer="streaming", sizes=((16, 16),), white=True)
    small = Model(manifest, Streaming(StreamingConfig(64, 16, 1 / 16)), Codes({}, {}, "ab" * 32), {})
    p = replace(compile_scene(scene), model="small", weights="ab" * 32)
    with pytest.raises(RenderError, match="model `small` samples pixels in one way only, not `four`"):
        draw_program(p, small, samples="four")
