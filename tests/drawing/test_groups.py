"""Groups in the plane: states and intervals against the fold by recursion, and pictures of any tree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.groups import (
    BEGINS,
    ENDS,
    INTERSECT,
    OPERATOR,
    SUBTRACT,
    UNION,
    Groups,
    felt,
    read_groups,
    token_fault,
    token_name,
    widths_of,
)
from scenelang.compiler.program import Program, ProgramError, parse_program, program_bytes
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.meetings import Interval, Pairs, meetings_of, nesting
from scenelang.drawing.proof import Joins, blended, enclosed
from tests.groups import State, folded, random_tokens
from tests.pictures import Array

RNG = np.random.default_rng
NETWORK = load_arrays("shapes2d").network


def stars(count: int, tokens: list[int], widths: np.ndarray | None = None) -> Program:
    """A Program of so many objects, joined as tokens say."""
    text = "square { scale(0.3); material flat { color(#d33); } } " * count
    program = nsg.compile(nsg.loads(text), model="shapes2d", without=("drop_hidden",))
    vectors = program.vectors.copy()
    if widths is not None:
        vectors[:, Field(NETWORK, vectors, program.tokens).layout.places.width] = widths
    return replace(program, tokens=np.array(tokens, np.int8), vectors=vectors)


@pytest.mark.parametrize("seed", range(6))
def test_states_are_those_of_the_recursion(seed: int) -> None:
    """At random distances."""
    rng, count, columns = RNG(seed), 10, 400
    tokens = random_tokens(rng, count)
    raw = np.array(tokens) & OPERATOR
    given = np.where(raw > 0, rng.choice([0.0, 0.1, 0.3], count), 0.0)
    program = stars(count, tokens, given)
    field = Field(NETWORK, program.vectors, program.tokens)
    d = rng.normal(0, 0.25, (count, columns))
    found = field.fold(d[:, None].astype(np.float32), np.arange(count))[0][0]
    colours = [np.tile(c, (columns, 1)) for c in np.asarray(field.colours).T]
    wanted = folded(list(d), colours, tokens, given.tolist())[0]
    near = abs(wanted) < 0.6
    assert (np.sign(found) == np.sign(wanted))[~near].all()
    assert near.sum() > 0.5 * columns
    assert np.mean(abs(found - wanted)[near] < 4e-3) > 0.995


def test_names_of_tokens() -> None:
    tokens = (0, 2, BEGINS | 3, 2 << ENDS | 2, 1 << ENDS | BEGINS | 1)
    assert [*map(token_name, tokens)] == ["union", "subtract", "intersect (", "subtract ))", "smooth ( )"]


def test_a_group_begins_with_its_first_row_as_it_is() -> None:
    """However far that is: farther than what stands for nothing, too."""
    program = stars(3, [UNION, INTERSECT | BEGINS, SUBTRACT | 1 << ENDS])
    field = Field(NETWORK, program.vectors, program.tokens)
    d = np.array([0.2, 3.0, 0.5], np.float32)
    assert field.fold(d[:, None, None], np.arange(3))[0][0, 0] == pytest.approx(3.0, abs=0.01)


def test_forged_tokens_are_refused() -> None:
    for tokens in ([4], [1], [0, 8], [0, 4], [0, -1], [0, -128], [0, 4, 16], [8], [0, *[4] * 16, 120, 8]):
        assert token_fault(np.array(tokens, np.int8)) is not None, tokens
        with pytest.raises(ProgramError, match=r"token|group"):
            stars(len(tokens), tokens)
    deepest = np.array([0, *[4] * 15, 15 << ENDS], np.int8)
    assert token_fault(deepest) is None
    assert read_groups(deepest).deepest == 15


def test_a_program_with_groups_is_format_4_and_comes_back() -> None:
    for tokens, widths, kind in (
        ([0, 2, 0], [0, 0, 0], 1),
        ([0, 2 | BEGINS, 3 | 1 << ENDS], [0, 0, 0], 4),
        ([0, 2, 0], [0, 0.2, 0], 4),
        ([0, 1, 0], [0, 0.2, 0], 1),
    ):
        program = stars(3, tokens, np.array(widths))
        data = program_bytes(program)
        assert rf"\"format\":{kind},".encode() in data
        again = parse_program(data)
        assert again.digest() == program.digest()
        assert again.extended == (kind == 4)


def test_how_far_rows_matter_is_the_same_for_flat_streams_by_either_way() -> None:
    count, none = 8, np.zeros(0, np.intp)
    for seed in range(40):
        rng = RNG(seed)
        tokens = np.append(0, rng.integers(0, 4, count - 1))
        widths = widths_of(tokens, rng.random(count) * (rng.random(count) < 0.4))
        flat = Groups(tokens, np.zeros(count, bool), np.zeros((count, 0), np.intp), 0 * tokens, none, none)
        around = flat._replace(path=np.full((count, 1), -1))
        for one, other in zip(felt(flat, widths), felt(around, widths), strict=True):
            np.testing.assert_allclose(one, other)


@pytest.mark.parametrize("seed", range(12))
def test_rows_matter_no_farther_than_is_said(seed: int) -> None:
    """A leaf that is moved from its level to anywhere beyond changes no sign, nor any colour inside."""
    rng, count = RNG([5, seed]), 7
    tokens = random_tokens(rng, count)
    raw = np.array(tokens) & OPERATOR
    given = np.where(raw > 0, rng.choice([0.0, 0.1, 0.3], count), 0.0)
    seen = felt(read_groups(np.array(tokens, np.int8)), widths_of(raw, given))
    colours = [rng.uniform(0, 1, (1, 3)) for _ in range(count)]
    for row in np.flatnonzero(~seen.everywhere):
        near = rng.normal(0, 0.3, (count, 400))
        near[row] = seen.total[row] + rng.uniform(0, 0.5, 400) + 1e-9
        far = near.copy()
        far[row] = 50.0
        states = [
            folded(list(d), [np.tile(c, (400, 1)) for c in colours], tokens, given.tolist())
            for d in (near, far)
        ]
        (d, c), (e, f) = states  # type: ignore[misc]
        assert ((d < 0) == (e < 0)).all()
        inside = d < 0
        np.testing.assert_allclose(c[inside], f[inside], rtol=0, atol=1e-9)


def test_what_is_cut_out_of_a_rounded_operand_matters_everywhere() -> None:
    """In a n (b - c) with a width, c changes how deep inside b points are, which a's edge is rounded by."""
    groups = read_groups(np.array([UNION, INTERSECT | BEGINS, SUBTRACT | 1 << ENDS], np.int8))
    assert felt(groups, np.array([0.0, 0.1, 0.0])).everywhere.tolist() == [False, True, True]
    assert felt(groups, np.zeros(3)).everywhere.tolist() == [False, True, False]


def test_what_is_intersected_is_taken_where_nothing_of_the_group_is_near() -> None:
    """A group's later rows may hide its first one in a block, and be out of reach in a smaller one."""
    scene = nsg.loads(
        "canvas(256, 256); intersect { square { scale(1.2); material flat { color(#36c); } } union {"
        " star { scale(0.5); translate(0.6, -0.6); } pentagon { scale(0.45); translate(-0.4, 0.3); }"
        " triangle { scale(0.4); translate(-0.5, -0.5); } star { scale(0.3); translate(0.2, 0.6); } } }"
    )
    program = nsg.compile(scene)
    pruned, whole = (
        np.asarray(draw(NETWORK, program, samples="four", skip=skip).image) for skip in (True, False)
    )
    assert abs(pruned - whole).max() < 1 / 255


def shown_by(state: State, behind: Array) -> Array:
    """What samples (M,) of a region show (M, K)."""
    if state is None:
        return behind
    whole = np.concatenate([state[1], np.ones((len(state[1]), len(behind) - 3))], 1)
    return np.where((state[0] < 0)[:, None], whole, behind)


@pytest.mark.parametrize(("seed", "behind"), [(0, np.zeros(4)), (1, np.array([0.2, 0.9, 0.5]))])
@pytest.mark.parametrize("kind", ["blends", "sharp", "rounded", "groups", "sharp groups"])
def test_no_sample_leaves_its_interval(seed: int, kind: str, behind: Array) -> None:
    """Streams of all tokens, also without blends, where outside of everything only signs matter."""
    rng, blocks = np.random.default_rng(seed), 250
    counts = rng.integers(1, 7, blocks)
    block = np.repeat(np.arange(blocks), counts)
    deepest = 3 if "groups" in kind else 0
    whole = [random_tokens(rng, int(count), deepest) for count in counts]
    tokens = np.array([token for part in whole for token in part])
    if "sharp" in kind:
        tokens = np.where((tokens & OPERATOR) == 1, tokens - 1, tokens)
    rounds = "sharp" not in kind and kind != "blends"
    given = rng.choice([0.0, 0.2], len(tokens)) * rounds
    widths = widths_of(tokens & OPERATOR, given)
    free, parts = [], np.split(np.arange(len(tokens)), counts.cumsum()[:-1])
    for part in parts:
        seen = felt(read_groups(tokens[part].astype(np.int8)), widths[part])
        free.append(~seen.inside & (seen.blends == 0))
    groups = read_groups(tokens.astype(np.int8))
    middle = rng.normal(0, 0.3, len(block)) * rng.choice([0.1, 1], len(block))
    rise = rng.choice([0, 1e-3, 0.05, 0.4], len(block))
    colours = rng.choice(2, (3, len(block))).astype(float)
    meetings, source = meetings_of(Pairs.of(block, np.arange(len(block))))
    some = Interval((middle - rise)[source], (middle + rise)[source])
    own = np.where(groups.first, 0.0, widths)
    joins, first = Joins(groups.tokens, own, np.concatenate(free)).some(source), groups.rows
    nest = nesting(meetings, groups) if deepest else None
    if not deepest:
        joins = joins._replace(free=~blended(meetings, (widths > 0)[source]))
    shown, changing = enclosed(
        meetings,
        some,
        Interval(colours[:, source], colours[:, source]),
        joins,
        behind,
        nest,
        Joins(groups.joins, widths[first], np.concatenate(free)[first]),
    )
    left = np.empty(len(block), bool)
    left[source] = changing
    sure = 0
    for column, number in enumerate(meetings.columns):
        pairs = np.flatnonzero(block == number)
        share = rng.uniform(-1, 1, (len(pairs), 60)) ** rng.choice([1, 0], (1, 60), p=[0.7, 0.3])
        d = middle[pairs, None] + rise[pairs, None] * share * rng.choice([-1, 1], share.shape)
        c = [np.tile(colours[:, pair], (60, 1)) for pair in pairs]
        rows = list(d), c, tokens[pairs].tolist(), widths[pairs].tolist()
        seen = shown_by(folded(*rows), behind)
        assert (seen - shown.high[:, column]).max() < 1e-9
        assert (shown.low[:, column] - seen).max() < 1e-9
        # what is left shows the same where nothing was
        alone = shown_by(folded(*rows, left[pairs].tolist()), behind)
        np.testing.assert_allclose(np.broadcast_to(alone, seen.shape), seen, atol=1e-9)
        sure += bool((shown.high - shown.low)[:, column].max() < 1e-9)
    assert sure > 0.4 * blocks
