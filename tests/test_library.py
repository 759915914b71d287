"""The library for embedders: load, render, frames, mistakes as values, notebooks, and what is refused."""

from __future__ import annotations

import dataclasses
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.drawing import torch_backend
from scenelang.drawing.how import Device
from scenelang.drawing.neural import files
from scenelang.web import notebook

SMALL = (24, 16)
MOVING = "animate(1, 6); canvas(48, 48); square { scale(0.5); rotate(15deg * frame); }"
STAR = nsg.Scene(canvas=SMALL, nodes=nsg.Object("star", nsg.Scale(0.9)))


def moving() -> list[nsg.Scene]:
    return [nsg.loads(MOVING, frame=frame, size=SMALL) for frame in range(6)]


def test_values_of_params_and_mistakes(tmp_path: Path) -> None:
    path, text = tmp_path / "a.nsg", "param k = 0.5 in 0..1; square { scale(0.1 + k); }"
    path.write_text(text)
    expected = nsg.Scene(nodes=nsg.Object("square", nsg.Scale(1.0)))
    assert nsg.load(path, k=0.9) == nsg.load(str(path), k="0.9") == expected
    assert nsg.load(path, params={"k": 0.9}) == nsg.loads(text, k=0.9) == expected
    with pytest.raises(nsg.SceneError, match="E0302") as caught:
        nsg.loads("square { rotate(45); scale(foo); }")
    assert [d.code for d in caught.value.diagnostics] == ["E0302", "E0201"]


@pytest.mark.torch
def test_public_names() -> None:
    assert nsg.__all__ == sorted(nsg.__all__)
    assert set(nsg.__all__) <= set(dir(nsg))
    for name in nsg.__all__:
        assert not Path(str(nsg.__file__)).with_name(name).is_dir()  # importing a package would hide it
        assert getattr(nsg, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'lode'"):
        nsg.lode  # noqa: B018


def test_a_model_that_is_not_named_is_that_of_the_dimension() -> None:
    for text, name in (("square { twirl(1); }", "shapes2d"), ("sphere;", "solids3d"), ("", "shapes2d")):
        assert nsg.compile(nsg.loads(text)).model == name
    assert nsg.compile(nsg.loads('model "textures2d"; square;')).model == "shapes2d"  # its earlier name
    with pytest.raises(nsg.SceneError, match="E0514"):
        nsg.compile(nsg.Scene(model="other"))


def test_size_is_the_canvas_wherever_it_is_given(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text(MOVING)
    loaded = nsg.load(tmp_path / "a.nsg", size=SMALL)
    assert loaded == nsg.loads(MOVING, size=SMALL) == nsg.loads(MOVING).sized(SMALL)
    assert loaded.canvas == SMALL
    drawn = nsg.render(loaded, threads=1)
    assert drawn.shape == (16, 24, 3)
    assert np.array_equal(nsg.render(nsg.loads(MOVING), size=SMALL, threads=1), drawn)
    exact = nsg.render(nsg.loads(MOVING), size=SMALL, backend="reference")
    assert np.abs(drawn - exact).mean() < 0.01
    with pytest.raises(ValueError, match="compiled for its canvas"):
        nsg.render(nsg.compile(loaded), size=SMALL)
    for wrong in ((0, 3), (3, 9000), (2.5, 3), (3,)):
        with pytest.raises(ValueError, match="canvas"):
            nsg.loads(MOVING, size=wrong)  # type: ignore[arg-type]


def test_scenes_are_frames(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text(MOVING)
    given = list(nsg.render_frames(iter(moving()), threads=1))
    read = list(nsg.render_frames(tmp_path / "a.nsg", size=SMALL, threads=1))
    assert np.array_equal(given, read)
    made = nsg.animate(moving(), tmp_path / "given.gif", threads=1)
    nsg.animate(tmp_path / "a.nsg", tmp_path / "read.gif", size=SMALL, threads=1)
    assert (tmp_path / "given.gif").read_bytes() == (tmp_path / "read.gif").read_bytes()
    assert made.frames == 6
    slow = nsg.animate([STAR, STAR.sized((16, 24))], tmp_path / "b.gif", fps=2, size=SMALL)
    with Image.open(slow.files[0]) as film:
        assert film.size == SMALL


def test_scenes_of_several_canvases_are_a_batch() -> None:
    batch = [STAR, nsg.loads(MOVING), STAR.sized((16, 24)), STAR]
    drawn = list(nsg.render_frames(batch, threads=1))
    for picture, scene in zip(drawn, batch, strict=True):
        assert np.array_equal(picture, nsg.render(scene, threads=1, device="cpu"))  # by torch, as frames are
    assert np.array_equal(*nsg.render_frames(batch, frames="2..3", size=SMALL, threads=1))
    (only,) = nsg.render_frames(STAR, threads=1)
    assert np.array_equal(only, drawn[0])


def test_what_scenes_cannot_be(tmp_path: Path) -> None:
    calls: list[tuple[Callable[[Path], object], str]] = [
        (lambda out: nsg.animate([STAR, STAR], out), "fps says how fast"),
        (lambda out: nsg.animate([STAR, STAR.sized((9, 9))], out, fps=2), "several canvases"),
        (lambda out: nsg.animate([], out), "neither a path nor Scenes"),
        (lambda out: list(nsg.render_frames([1, 2])), "neither a path nor Scenes"),  # type: ignore[list-item]
        (lambda out: list(nsg.render_frames(STAR, params={"k": 1})), "params and root are for files"),
        (lambda out: list(nsg.render_frames([STAR], frames="3..4")), "frame 3"),
        (lambda out: nsg.render_many(STAR, out), "several Scenes are drawn by `animate`"),  # type: ignore[arg-type]
    ]
    for call, words in calls:
        with pytest.raises((TypeError, ValueError, nsg.FramesError), match=words):
            call(tmp_path / "a.gif")
    assert not list(tmp_path.iterdir())


def test_check_says_what_the_command_says(tmp_path: Path) -> None:
    small = "disc { material bricks { scale(0.01); } }\n"
    text = f"nsg 1;\nlet unused = 1;\nsquare {{ scale(0.5) rotate(45); }}\n{small}"
    (tmp_path / "a.nsg").write_text(text)
    codes = [d.code for d in nsg.check_text(text)]
    assert codes == [d.code for d in nsg.check(tmp_path / "a.nsg")] == ["E0102"]
    fixed, left = nsg.fix_text(text)
    assert fixed == f"nsg 1;\nlet _unused = 1;\nsquare {{ scale(0.5); rotate(45deg); }}\n{small}"
    assert [d.code for d in left] == [d.code for d in nsg.check_text(fixed)] == ["W0511"]
    assert not list(nsg.check_text("star;"))
    late = "animate(1, 8); let v = [1, 2]; square { translate(v[frame > 5 ? 2 : 0], 0); }"
    assert [d.code for d in nsg.check_text(late)] == ["E0307"]
    assert "E0211" in {d.code for d in nsg.check_text("star;", params={"j": 1})}
    (tmp_path / "b.nsg").write_bytes(b"\xff")
    assert [d.code for d in nsg.check(tmp_path / "b.nsg")] == ["E0214"]
    with pytest.raises(OSError, match="none"):
        nsg.check(tmp_path / "none.nsg")


@pytest.mark.parametrize("value", [STAR, nsg.compile(STAR)], ids=["scene", "program"])
def test_notebooks_show_a_picture(value: Any) -> None:
    shown = value._repr_mimebundle_()
    with Image.open(io.BytesIO(shown["image/png"])) as picture:
        assert picture.size == SMALL
        assert np.array_equal(np.asarray(picture), nsg.render(value).to_uint8())
    assert "24 × 16 pixels" in shown["text/plain"]
    (frame,) = re.findall(r'<iframe sandbox="([^"]*)" title="A picture of a star', shown["text/html"])
    assert frame == "allow-scripts"
    assert shown["text/html"].count("<") == 2  # the page is a text in an attribute


def test_notebooks_show_pictures_alone_where_that_is_wished(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(notebook.SWITCH, "viewer")
    nsg.set_notebook("picture")
    assert set(STAR._repr_mimebundle_()) == {"image/png", "text/plain"}
    nsg.set_notebook("viewer")
    assert "text/html" in STAR._repr_mimebundle_()
    with pytest.raises(ValueError, match="`film`"):
        nsg.set_notebook("film")  # type: ignore[arg-type]


def test_notebooks_show_mistakes_as_text(monkeypatch: pytest.MonkeyPatch) -> None:
    bad = nsg.Scene(nodes=nsg.Object("circle"))._repr_mimebundle_()
    assert set(bad) == {"text/plain"}
    assert "no geometry `circle`" in bad["text/plain"]
    huge = STAR.sized((8192, 8192))._repr_mimebundle_()
    assert "too large" in huge["text/plain"]
    monkeypatch.setattr("scenelang.drawing.render.render", None)
    assert set(notebook.bundle(STAR, SMALL, "Scene")) == {"text/plain"}


def test_files_stand_for_what_is_in_them(tmp_path: Path) -> None:
    file, program = tmp_path / "a.nsg", tmp_path / "a.safetensors"
    file.write_text("canvas(24, 16);\nstar { scale(0.9); }\n")
    scene = nsg.load(file)
    nsg.compile(file).save(program)
    assert nsg.load_program(program).digest() == nsg.compile(scene).digest()
    for source in (str(file), file, program):
        assert np.array_equal(nsg.render(source), nsg.render(scene))
        alpha = nsg.render_outputs(source, ("alpha",)).alpha
        assert np.array_equal(alpha, nsg.render_outputs(scene, ("alpha",)).alpha)
    assert np.array_equal(nsg.render(file, backend="reference"), nsg.render(scene, backend="reference"))
    assert nsg.render(file, size=(8, 9)).shape == (9, 8, 3)
    assert nsg.render_outputs(file, ("object",)).objects == {
        1: {"geometry": "star", "file": str(file), "line": 2, "column": 1}
    }
    assert np.array_equal(nsg.prove(file)[1].bound, nsg.prove(scene)[1].bound)


def test_mistakes_of_a_file_that_is_drawn_have_their_places(tmp_path: Path) -> None:
    file = tmp_path / "a.nsg"
    file.write_text("square {}\nsquare { scale(1e-9, 1); scale(1e-9, 1); }\n")
    with pytest.raises(nsg.SceneError, match=r"a.nsg:2:"):
        nsg.render(file)


def test_what_is_neither_a_scene_nor_a_path() -> None:
    calls: list[Callable[[Any], object]] = [nsg.compile, nsg.render, nsg.prove]
    calls += [lambda x: nsg.render(x, backend="reference"), lambda x: nsg.render_many(x, "never")]
    for call in (*calls, lambda x: nsg.render_outputs(x, ("alpha",))):
        with pytest.raises(TypeError, match=r"^list where .* path"):
            call([STAR])


CANVAS = "canvas(64, 64);"
FOUR = """chain {
  square           { scale(0.8); translate(-0.2, 0); material flat { color(#d33); } }
  smooth pentagon  { twirl(0.6); bend(0.2); scale(0.5); rotate(30deg); }
  subtract star    { scale(0.3); translate(0.1, 0.1); }
  intersect square { rotate(45deg); }
}"""
MANY = "for (i in 0..<200) { star { scale(0.1); translate(2 * rand(i) - 1, 2 * rand(i + 500) - 1); } }"
STEP = 1 / 255
BOTH = pytest.mark.parametrize("device", ["auto", "cpu"], ids=["numpy", "torch"])


def program(text: str) -> nsg.Program:
    return nsg.compile(nsg.loads(text))


def test_an_empty_scene_is_the_background() -> None:
    image = nsg.render(nsg.loads(CANVAS + "background(#369);"))
    assert image.shape == (64, 64, 3)
    assert np.abs(image - np.array([0.2, 0.4, 0.6])).max() < STEP
    clear = nsg.render(nsg.loads(CANVAS + "background(none);"))
    assert clear.shape == (64, 64, 4)
    assert clear[..., 3].max() < STEP
    image = nsg.render(nsg.loads(CANVAS + "square { material flat { color(#d33); } }"))
    assert image.dtype == np.float32
    assert np.abs(image[32, 32] - np.array([0xDD, 0x33, 0x33]) / 255).max() < STEP
    assert np.abs(image[0, 0] - 1).max() < STEP


def test_200_objects() -> None:
    scene = nsg.loads("canvas(128, 128); background(#000);" + MANY)
    drawn, exact = nsg.render(scene), nsg.render(scene, backend="reference")
    assert len(nsg.compile(scene)) == 200
    assert np.abs(drawn - exact).mean() < 0.01


def test_non_square_and_transparent() -> None:
    scene = nsg.loads("canvas(96, 40); background(none); star { translate(1.2, 0); }")
    drawn, exact = nsg.render(scene), nsg.render(scene, backend="reference")
    assert drawn.shape == exact.shape == (40, 96, 4)
    assert np.abs(drawn[..., 3] - exact[..., 3]).mean() < 0.02
    assert drawn[..., 3].max() > 0.99


@BOTH
def test_pictures_repeat(device: Device) -> None:
    compiled, shares = program(FOUR), list[float]()
    first = nsg.render(nsg.loads(FOUR), device=device, progress=shares.append)
    assert max(shares) == 1.0
    nsg.render(program(CANVAS + FOUR))
    assert np.array_equal(nsg.render(compiled, device=device), first)
    for threads in (1, 3):
        image = nsg.render(compiled, device=device, threads=threads)
        assert np.abs(image - first).max() <= STEP
        assert np.array_equal(nsg.render(compiled, device=device, threads=threads), image)


def test_torch_keeps_its_number_of_threads() -> None:
    import torch

    before = torch.get_num_threads()
    try:
        torch.set_num_threads(3)
        nsg.render(program(CANVAS + FOUR), device="cpu", threads=2)
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(before)


@BOTH
def test_other_and_missing_weights(device: Device, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiled = program(CANVAS)
    with pytest.raises(nsg.RenderError, match="compile the scene again"):
        nsg.render(dataclasses.replace(compiled, weights="0" * 64), device=device)
    with pytest.raises(nsg.RenderError, match="unknown model `other`"):
        nsg.render(dataclasses.replace(compiled, model="other"), device=device)
    torch_backend._load.cache_clear()
    files._load.cache_clear()
    monkeypatch.setattr("scenelang.compiler.weights.weights_path", lambda name, digest: tmp_path / "none")
    with pytest.raises(nsg.RenderError, match="cannot read the weights"):
        nsg.render(compiled, device=device)


def test_what_is_refused() -> None:
    good = program(FOUR)
    vectors, tokens = good.vectors.copy(), good.tokens.copy()
    vectors[1, 7], tokens[2] = np.nan, 7
    with pytest.raises(nsg.ProgramError, match=r"vectors of object 1 .* not finite"):
        dataclasses.replace(good, vectors=vectors)
    with pytest.raises(nsg.ProgramError, match="a group that does not end"):
        dataclasses.replace(good, tokens=tokens)
    with pytest.raises(nsg.SceneError, match="E0501"):
        nsg.render(nsg.Scene(nodes=(nsg.Object("circle"),)))
    with pytest.raises(nsg.SceneError, match="E0501"):
        nsg.render(nsg.Scene(nodes=(nsg.Object("circle"),)), backend="reference")
    with pytest.raises(nsg.RenderError, match="the reference draws scenes"):
        nsg.render(program(CANVAS), backend="reference")
    with pytest.raises(ValueError, match="unknown backend"):
        nsg.render(program(CANVAS), backend="magic")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown device"):
        nsg.render(program(CANVAS), device="tpu")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="0 threads"):
        nsg.render(program(CANVAS), threads=0)


def test_the_reference_draws_what_a_model_does_not() -> None:
    text = CANVAS + "subtract { square {} intersect { star {} pentagon {} } }"
    with pytest.raises(nsg.SceneError, match="E0513"):
        nsg.render(nsg.loads('model "shapes2d-reading";' + text))
    image = nsg.render(nsg.loads(text + "background(#000);"), backend="reference")
    assert 0.1 < image.mean() < 0.9


def test_images_save_and_show_themselves(tmp_path: Path) -> None:
    image = nsg.render(nsg.loads(CANVAS + "background(none); square {}"))
    assert isinstance(image, nsg.Image)
    image.save(tmp_path / "a.png")
    image.save(tmp_path / "a.bmp")
    assert (tmp_path / "a.png").read_bytes() == image._repr_png_()
    with pytest.raises(ValueError, match="no image format"):
        image.save(tmp_path / "a.nsg")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.bmp", "a.png"]
