"""Compatibility with revision 090346d: Programs it saved, and calls of its public API.

`before/api.json` has each public name of that revision and its parameters: ``/x`` by place alone, ``*x`` by
name alone, ``...x`` and ``***x`` any number, ``x?`` may be left out; null where it was not a call. `render`'s
``precision`` went with 8-bit inference, and `Scene.to_python` with the code that it wrote.
`before/trees.safetensors` is the first of format 4, that of groups. Pictures next to them were drawn by
the weights that they were compiled for.
"""

from __future__ import annotations

import inspect
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import PIL.Image as Pillow
import pytest

import scenelang as nsg
from scenelang.compiler.weights import replaced, weights_path
from scenelang.drawing.how import Device
from scenelang.web.export import view_of

BEFORE = Path(__file__).parent / "before"
API: dict[str, str | None] = json.loads((BEFORE / "api.json").read_text("utf-8"))
GONE = {"render": {"precision"}}


SAVED = ("alpha", 2), ("white", 0), ("trees", 0), ("textures", 0)


@pytest.mark.parametrize(("name", "frame"), SAVED)
def test_saved_programs_are_those_of_today(name: str, frame: int, tmp_path: Path) -> None:
    """All but the digest of replaced weights; ``white`` is of a network for another size."""
    saved = BEFORE / f"{name}.safetensors"
    loaded = nsg.load_program(saved)
    if name == "white":
        assert replaced(loaded.weights)
        return
    compiled = nsg.compile(nsg.load(BEFORE / f"{name}.nsg", frame=frame))
    assert np.array_equal(loaded.vectors, compiled.vectors)
    assert np.array_equal(loaded.tokens, compiled.tokens)
    assert np.array_equal(loaded.bounds, compiled.bounds)
    assert (loaded.model, loaded.objects) == (compiled.model, compiled.objects)
    assert loaded.weights == compiled.weights or replaced(loaded.weights)
    assert all(place is not None and place.line > 1 for place in loaded.places)
    loaded.save(tmp_path / "again.safetensors")
    again = (tmp_path / "again.safetensors").read_bytes()
    assert (again == saved.read_bytes()) == (name != "textures")  # whose model has another name now


@pytest.mark.parametrize("device", ["auto", "cpu"])
@pytest.mark.parametrize("name", [name for name, _ in SAVED])
def test_saved_programs_draw_as_before(name: str, device: Device) -> None:
    """By numpy or torch, whatever weights ship today."""
    drawn = nsg.render(nsg.load_program(BEFORE / f"{name}.safetensors"), device=device, threads=1)
    with Pillow.open(BEFORE / f"{name}.png") as kept:
        assert abs(np.asarray(drawn) - np.asarray(kept) / 255).max() < 1.5 / 255


def test_pages_of_saved_programs_have_their_weights() -> None:
    old, new = (
        view_of(nsg.load_program(BEFORE / "trees.safetensors")),
        view_of(nsg.compile(BEFORE / "trees.nsg")),
    )
    assert replaced(old.data["model"]["weights"])
    assert not replaced(new.data["model"]["weights"])
    assert old.data["network"]["decoders"][0] != new.data["network"]["decoders"][0]


def test_weights_of_another_model_are_refused(tmp_path: Path) -> None:
    for model in ("solids3d", "shapes2d-streaming"):
        forged = replace(nsg.load_program(BEFORE / "trees.safetensors"), model=model)
        forged.save(tmp_path / "forged.safetensors")
        with pytest.raises(nsg.ProgramError, match="weights of another model"):
            nsg.load_program(tmp_path / "forged.safetensors")
        for device in ("auto", "cpu"):
            with pytest.raises(nsg.RenderError):
                nsg.render(forged, device=device)


def test_other_digests_lead_nowhere() -> None:
    for weights in ("", "0" * 64, "..", "../shapes2d"):
        assert replaced(weights) == ""
        assert weights_path("shapes2d", weights) == weights_path("shapes2d")


def test_public_names_and_members_are_there() -> None:
    for name in API:
        owner, _, member = name.partition(".")
        assert owner in nsg.__all__, name
        cls = getattr(nsg, owner)
        fields = {f for base in getattr(cls, "__mro__", ()) for f in getattr(base, "__annotations__", ())}
        assert not member or hasattr(cls, member) or member in fields, name


def test_calls_are_taken() -> None:
    """All arguments by place where they were taken so, all by name, and only those that were required."""
    for name, params in API.items():
        if params is None:
            continue
        owner, _, member = name.partition(".")
        takes = inspect.signature(getattr(getattr(nsg, owner), member) if member else getattr(nsg, owner))
        words = [word for word in params.split() if word.strip("?*/") not in GONE.get(name, ())]
        plain = [word for word in words if not word.startswith(("...", "***"))]
        placed = [word for word in plain if word[0] != "*"]
        named = {word.strip("*?"): None for word in plain if word[0] not in "/"}
        alone = [None for word in plain if word[0] == "/"]
        if "***data" in words:  # fields of a model, which are among the members
            takes.bind_partial(*alone)
            continue
        takes.bind(*[None] * len(placed), **{word.strip("*?"): None for word in plain if word[0] == "*"})
        takes.bind(*alone, **named)
        required = [word for word in placed if word[-1] != "?"]
        takes.bind(*[None] * len(required), **{w[1:]: None for w in plain if w[0] == "*" and w[-1] != "?"})
