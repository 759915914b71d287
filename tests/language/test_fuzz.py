"""Random text, and random pieces of good scenes: diagnostics or a Scene, never a traceback."""

from __future__ import annotations

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenelang.language.values import FUNCTIONS
from scenelang.language.words import LANGUAGE
from scenelang.language.words import NODES as NODE_WORDS
from tests.language.cases import HERE, run_text

ATOMS = st.sampled_from(
    """1 0 2.5 -3 45deg 0.25turn 2s true false none X PI t u i a v m f(1) f(a) lib.x #d33 [1,2] [1,2,3] []
    [a,[1]] "s" 0..3 0..<2 (0deg..90deg) rand(1) len(v) hsv(1,1,1) nope f() 1e308 1e-320""".split()  # noqa: SIM905
) | st.just("material flat")
OPS = st.sampled_from((*"+-*/%^<>", "<=", ">=", "==", "!=", "&&", "||"))
CALLED = tuple(FUNCTIONS)
expressions = st.recursive(
    ATOMS,
    lambda inner: st.one_of(
        st.tuples(inner, OPS, inner).map(" ".join).map("({})".format),
        st.tuples(inner, inner, inner).map(lambda t: f"({t[0]} ? {t[1]} : {t[2]})"),
        inner.map("-{}".format),
        inner.map("!{}".format),
        st.tuples(inner, st.sampled_from("xgqz")).map(lambda t: f"({t[0]}).{t[1]}"),
        st.tuples(inner, inner).map(lambda t: f"({t[0]})[{t[1]}]"),
        st.tuples(st.sampled_from(CALLED), st.lists(inner, max_size=3)).map(
            lambda t: f"{t[0]}({', '.join(t[1])})"
        ),
        st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]"),
    ),
    max_leaves=6,
)
HEADS = st.sampled_from((*sorted(LANGUAGE), "m", "star", "nope", "k"))
NODES = st.sampled_from((*NODE_WORDS, "square", "star", "sqare", "k", "material flat", "module m(x)"))
simple = st.one_of(
    st.tuples(HEADS, st.lists(expressions, max_size=3)).map(lambda t: f"{t[0]}({', '.join(t[1])});"),
    st.tuples(st.sampled_from("abtv"), expressions).map(lambda t: f"let {t[0]} = {t[1]};"),
    expressions.map("param p = {};".format),
    expressions.map("fn f(x = 1, y = x) = {};".format),
    st.sampled_from(["material flat;", "k;", "square;", "nsg 1;", 'model "shapes2d";', "m(1) { scale(2); }"]),
)
statements = st.recursive(
    simple,
    lambda inner: st.one_of(
        st.tuples(NODES, st.lists(inner, max_size=3)).map(lambda t: f"{t[0]} {{ {' '.join(t[1])} }}"),
        st.tuples(expressions, st.lists(inner, max_size=3)).map(
            lambda t: f"for (i in {t[0]}) {{ {' '.join(t[1])} }}"
        ),
        st.tuples(expressions, st.lists(inner, max_size=2), inner).map(
            lambda t: f"if ({t[0]}) {{ {' '.join(t[1])} }} else {{ {t[2]} }}"
        ),
        inner.map("smooth {}".format),
    ),
    max_leaves=6,
)
OPTIONS = settings(max_examples=400, suppress_health_check=list(HealthCheck))


@OPTIONS
@given(st.lists(statements, max_size=5).map("\n".join))
def test_random_statements(text: str) -> None:
    outcome = run_text(text)
    assert (outcome.scene is None) == bool(outcome.diagnostics.errors)
    if outcome.scene is not None:
        again = run_text(outcome.scene.to_nsg(), frame=0).good()
        assert again == outcome.scene


@OPTIONS
@given(st.text(max_size=200))
def test_random_text(text: str) -> None:
    run_text(text)


SEEDS = [p.read_text("utf-8") for p in sorted((HERE / "mistaken").glob("*.nsg"))]


@OPTIONS
@given(st.sampled_from(SEEDS), st.data())
def test_cut_and_pasted_scenes(text: str, data: st.DataObject) -> None:
    a = data.draw(st.integers(0, len(text)))
    b = data.draw(st.integers(a, min(len(text), a + 60)))
    c = data.draw(st.integers(0, len(text)))
    run_text(text[:c] + text[a:b] + text[c:])
    run_text(text[:a] + text[b:])


@OPTIONS
@given(st.text(max_size=40))
def test_random_values_from_outside(text: str) -> None:
    for default in ("1", "30deg", "1s", "true", "#d33", '"s"'):
        outcome = run_text(f"param p = {default};", params={"p": text})
        assert set(outcome.codes) <= {"E0310", "E0309"}
