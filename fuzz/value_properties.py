"""Properties of whole values that are drawn: Scenes, Programs, weights, diagnostics."""

from __future__ import annotations

import json
from functools import cache
from typing import Any, Final

import numpy as np
from hypothesis import strategies as st

from fuzz.drawn import drawn
from fuzz.oracles import check_diagnostics
from fuzz.target import hold, load_target
from scenelang.compiler.lifting import WIDTH
from scenelang.compiler.program import Place, Program, ProgramError, parse_program, program_bytes
from scenelang.compiler.weights import load_codes
from scenelang.drawing.how import RenderError
from scenelang.drawing.render import render
from scenelang.language.diagnostics import Diagnostic, Edit, Fix, Label, SourceFile, Span
from scenelang.language.formatting import format_text
from scenelang.language.pages import CODES
from scenelang.language.scene import Scene
from tests.strategies import scenes

# ---------------------------------------------------------------- Scenes, Programs, weights


@drawn(scenes)
def scenes_survive_all_their_forms(scene: Scene) -> None:
    """JSON, text, formatted text, Python code, Program: what the fuzz target asks of JSON it did not make."""
    load_target("scene_json").check(scene.to_json().encode())
    laid = format_text(scene.to_nsg())
    hold(format_text(laid) == laid, "printed Scenes format once", laid[:300])


@cache
def _codes() -> list[tuple[float, ...]]:
    return list(load_codes("shapes2d").geometry.values())


_ENTRIES: Final = st.one_of(
    st.floats(-3, 3, width=32),
    st.sampled_from([0.0, 1.0, -1.0, 1e-30, 1e30, 3e38, -3e38, 1e-40]),
)


@st.composite
def programs(draw: st.DrawFn) -> Program:
    """Programs whose vectors are mostly sound, with a few entries that may be anything finite."""
    count = draw(st.integers(0, 5))
    vectors = np.zeros((count, WIDTH), np.float32)
    for row in vectors:
        row[:4] = draw(st.sampled_from(_codes()))
        row[4] = 1
        row[5:11] = row[20:26] = (1, 0, 0, 0, 1, 0)
        for _ in range(draw(st.integers(0, 6))):
            row[draw(st.integers(0, WIDTH - 1))] = draw(_ENTRIES)
    tokens = np.array([draw(st.integers(0, 3)) if index else 0 for index in range(count)], np.int8)
    corners = [sorted(draw(st.tuples(_ENTRIES, _ENTRIES))) for _ in range(2 * count)]
    bounds = np.array(
        [[a, c, b, d] for (a, b), (c, d) in zip(corners[::2], corners[1::2], strict=True)], np.float32
    )
    place = st.builds(Place, st.sampled_from(["a.nsg", "π.nsg", ""]), *[st.integers(1, 2**31 - 1)] * 4)
    return Program(
        vectors=vectors,
        tokens=tokens,
        bounds=bounds.reshape(count, 4),
        canvas=draw(st.tuples(st.integers(1, 24), st.integers(1, 24))),
        background=draw(st.none() | st.tuples(*[st.floats(0, 1)] * 3)),
        model="shapes2d",
        weights=load_codes("shapes2d").digest,
        objects=tuple(draw(st.sampled_from(["square", "star"])) for _ in range(count)),
        places=tuple(draw(st.none() | place) for _ in range(count)),
    )


@drawn(programs())
def programs_stay_in_their_files_and_can_be_drawn(program: Program) -> None:
    """The fuzz target's demands on files it did not make; digests tell Programs apart."""
    written = program_bytes(program)
    load_target("program").check(written)
    again = parse_program(written)
    hold(
        again.digest() == program.digest() and again.places == program.places, "Programs stay in their files"
    )
    if len(program):
        other = program.vectors.copy()
        other[0, 40] += 1.0
        try:
            changed = Program(**{**_fields(program), "vectors": other})
        except ProgramError:
            return
        same = np.array_equal(other, program.vectors)
        hold(same == (changed.digest() == program.digest()), "digests tell Programs apart")
    try:
        one, two = (render(program, device="cpu", threads=threads) for threads in (1, 2))
    except RenderError:
        return
    hold(np.allclose(one, two, atol=1 / 255), "threads do not show")


def _fields(program: Program) -> dict[str, Any]:
    return {name: getattr(program, name) for name in Program.__dataclass_fields__}


@drawn(st.data())
def networks_of_any_size_load_as_they_were_saved(data: st.DataObject) -> None:
    """Weights of random sizes and numbers, with one entry that may be extreme."""
    import torch
    from safetensors.torch import save

    from scenelang.drawing.neural.load import Framed
    from scenelang.drawing.neural.network import FramedConfig

    sizes = {
        name: data.draw(st.integers(1, 6), name)
        for name in ("features", "state", "decoder_width", "paint_lines")
    }
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(data.draw(st.integers(0, 1000)))
        network = Framed(FramedConfig(**sizes), 4, 1)
    plain = {name: value.detach().contiguous() for name, value in network.state_dict().items()}
    name = data.draw(st.sampled_from(sorted(plain)))
    plain[name].view(-1)[0] = data.draw(_ENTRIES)
    header = {"format": 1, "config": {"network": {"code": 4, "material_code": 12, **sizes}}}
    load_target("weights").check(save(plain, {"scenelang": json.dumps(header)}))


# ---------------------------------------------------------------- diagnostics of any text


@st.composite
def diagnostics(draw: st.DrawFn) -> list[Diagnostic]:
    """Diagnostics with places anywhere in any texts, in any number of files."""
    names = st.text(max_size=12)
    sources = [SourceFile(draw(names), draw(st.text(max_size=80))) for _ in range(draw(st.integers(1, 2)))]

    def place() -> Span:
        source = draw(st.sampled_from(sources))
        ends = sorted(draw(st.tuples(*[st.integers(0, len(source.text))] * 2)))
        return Span(source, ends[0], ends[1])

    found = []
    for _ in range(draw(st.integers(0, 4))):
        labels = tuple(Label(place(), draw(names)) for _ in range(draw(st.integers(0, 3))))
        fix = Fix(draw(names), (Edit(place(), draw(names)),)) if draw(st.booleans()) else None
        span = place() if draw(st.booleans()) else None
        code = draw(st.sampled_from(sorted(CODES)))
        found.append(Diagnostic(code, draw(names.filter(bool)), span, labels, draw(st.none() | names), fix))
    return found


@drawn(diagnostics())
def diagnostics_of_any_text_render(found: list[Diagnostic]) -> None:
    """In every format, each once, and nothing in a text breaks out of its place."""
    check_diagnostics(found, None)
