"""Small mistakes that the tests would not notice: ``python -m tests.mutants [PATH…] [--share S]``.

Changes one number, sign, operator, comparison or limit at a time in files of `TARGETS`, and runs the tests
that are to notice, in a process of its own. No file is written: the process compiles the changed text as it
imports the module. A mutant that no test kills is a survivor, unless ``mutants.json`` says why no test can.
Tests that start processes of their own see the file as it is and kill nothing.
"""

from __future__ import annotations

import argparse
import ast
import importlib.machinery
import json
import os
import random
import resource
import signal
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
EQUIVALENT = Path(__file__).with_suffix(".json")
"""A list of reasons, each with the mutants (patterns of their names) that it speaks of."""
_SHOWN = ast.expr, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Return, ast.If, ast.While, ast.For
_WIDTH = 100
_OPTIONS = "-x", "-q", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning"
HEAVY = (
    "hypothesis",
    "numpy",
    "PIL.Image",
    "pydantic",
    "pytest",
    "safetensors.numpy",
    "safetensors.torch",
    "torch",
)

DRAWING = (
    "tests/drawing/test_field.py", "tests/drawing/test_cell.py", "tests/compiler/test_exact.py",
    "tests/output/test_run.py", "tests/conformance",
)  # fmt: skip
COMPILING = (
    "tests/compiler", "tests/compiler/test_program_compile.py", "tests/compiler/test_flatten.py",
    "tests/compiler/test_checks.py", "tests/compiler/test_prove.py",
    "tests/output/test_clip.py", "tests/conformance",
)  # fmt: skip
SOLIDS = (
    "tests/drawing/test_closed.py", "tests/drawing/test_renderers_solids.py",
    "tests/drawing/test_trees.py", "tests/drawing/test_solids.py",
)  # fmt: skip
TREES = (
    "tests/drawing/test_groups.py", "tests/compiler/test_flatten.py", "tests/drawing/test_trees.py",
)  # fmt: skip
TARGETS: dict[str, tuple[str, ...]] = {
    "scenelang/drawing/solid/*.py": SOLIDS,
    "scenelang/drawing/exact/solid.py": ("tests/drawing/test_closed.py", "tests/drawing/test_solid.py"),
    "scenelang/drawing/neural/draw.py": DRAWING,
    "scenelang/drawing/neural/frames.py": DRAWING,
    "scenelang/drawing/neural/tables.py": DRAWING,
    "scenelang/drawing/neural/field.py": (*TREES, *DRAWING),
    "scenelang/drawing/neural/network.py": DRAWING,
    "scenelang/compiler/groups.py": TREES,
    "scenelang/drawing/neural/meetings.py": TREES,
    "scenelang/compiler/lifting.py": (
        "tests/compiler/test_exact.py",
        "tests/compiler/test_program_compile.py",
    ),
    "scenelang/compiler/[cgprs][ahetw]*s.py": COMPILING,
    "scenelang/compiler/lower.py": COMPILING,
    "scenelang/compiler/chain.py": COMPILING,
}
"""Files, and the tests that are to notice a change in them, the quickest first."""
SWAPS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.Mod: ast.Div, ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
    ast.And: ast.Or, ast.Or: ast.And,
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
NAMES = {
    a: b
    for pair in (
        "min max", "any all", "minimum maximum", "amin amax", "clamp_min clamp_max", "clamp_min_ clamp_max_",
        "sin cos", "floor ceil", "add_ sub_",
    )
    for a, b in (pair.split(), pair.split()[::-1])
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A file with one change: ``new`` stands for an entry of a node.

    Args:
        path: the file.
        line: of the statement.
        name: file, function, and the expression around the change before and after.
        tree: of the file, as it is.
        node, key: a node and its attribute, or a list and an index.
        new: what is put there.
    """

    path: Path
    line: int
    name: str
    tree: ast.Module
    node: Any
    key: str | int
    new: Any

    def code(self) -> Any:
        """The changed file, compiled."""
        with _changed(self.node, self.key, self.new):
            return compile(ast.fix_missing_locations(self.tree), self.path, "exec", dont_inherit=True)


@contextmanager
def _changed(node: Any, key: str | int, new: Any) -> Iterator[None]:
    """An attribute of a node, or an entry of a list, replaced for a while."""
    entry = node.__dict__ if isinstance(key, str) else node
    old, entry[key] = entry[key], new
    try:
        yield
    finally:
        entry[key] = old


def mutants(path: Path) -> Iterator[Mutant]:
    """All mutants of a file, from its top down."""
    tree = ast.parse(path.read_text("utf-8"))
    for around, node, key, new in _changes(tree, ()):
        at = max(i for i, n in enumerate(around) if isinstance(n, ast.stmt))
        statement = around[at]
        shown = next(
            (n for n in around[at:] if isinstance(n, _SHOWN) and len(_line(n)) <= _WIDTH), around[-1]
        )
        before = _line(shown)
        with _changed(node, key, new):
            after = _line(shown)
        within = ".".join(n.name for n in around if isinstance(n, (ast.FunctionDef, ast.ClassDef)))
        name = f"{path.relative_to(ROOT / 'scenelang')} {within}: {before} -> {after}"
        yield Mutant(path, statement.lineno, name, tree, node, key, new)


def _line(node: ast.AST) -> str:
    """A node on one line; of a compound statement its head."""
    text = ast.unparse(node)
    return " ".join((text.split("\n", 1)[0] if isinstance(node, ast.stmt) else text).split())


def _changes(
    node: ast.AST, above: tuple[ast.AST, ...]
) -> Iterator[tuple[tuple[ast.AST, ...], Any, str | int, Any]]:
    """(nodes around, from the file down; node, key, new value) for each change below a node."""
    if isinstance(node, (ast.Assert, ast.Raise, ast.Import, ast.ImportFrom, ast.JoinedStr)):
        return
    around = (*above, node)
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_params", "type_comment"):
            continue
        if name in ("id", "attr"):
            if value in NAMES:
                yield around, node, name, NAMES[value]
            continue
        entries = (
            [(value, i, v) for i, v in enumerate(value)] if isinstance(value, list) else [(node, name, value)]
        )
        for holder, key, child in entries:
            if type(child) in SWAPS:
                yield around, holder, key, SWAPS[type(child)]()
            elif isinstance(child, ast.AST):
                for new in _instead(child, name == "test"):
                    yield around, holder, key, new
                yield from _changes(child, around)


def _instead(node: ast.AST, test: bool) -> Iterator[ast.expr]:
    """Replacements of an expression."""
    if isinstance(node, ast.Constant):
        yield from (ast.Constant(value) for value in _numbers(node.value))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
        yield node.operand
    elif test and isinstance(node, (ast.Name, ast.Attribute, ast.Call)):
        yield ast.UnaryOp(ast.Not(), node)


def _numbers(value: object) -> tuple[float | bool, ...]:
    if isinstance(value, bool):
        return (not value,)
    if isinstance(value, int):
        return (1,) if value == 0 else (value // 2,) if value > 16 else (value - 1,)
    if not isinstance(value, float):
        return ()
    if value == 0.0:
        return (1.0,)
    return (value * 1e-3, value * 1e3) if not 1e-3 < value < 1e3 else (value * 0.5, value * 1.5)


@dataclass
class Runner:
    """Runs mutants in forked processes that have the heavy packages and nothing of ours."""

    orders: dict[str, list[str]] = field(default_factory=dict)

    def tests(self, mutant: Mutant) -> list[str]:
        """The tests of its file; what killed last comes first."""
        relative = str(mutant.path.relative_to(ROOT))
        pattern = next(p for p in TARGETS if fnmatchcase(relative, p))
        return self.orders.setdefault(relative, list(TARGETS[pattern]))

    def killer(self, mutant: Mutant | None, tests: list[str], limit_s: int) -> str | None:
        """The test file that fails, ``time`` where the limit is reached, None where all pass."""
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            os.dup2(os.open(os.devnull, os.O_RDWR), 1)
            os.dup2(1, 2)
            resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))
            resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
            os.write(writing, (_first_failure(mutant, tests) or "").encode())
            os._exit(0)
        os.close(writing)
        with os.fdopen(reading, "rb") as pipe:
            said = pipe.read().decode()
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status):
            return "time" if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else "crash"
        return said or None

    def judge(self, mutant: Mutant, limit_s: int) -> str | None:
        order = self.tests(mutant)
        killer = self.killer(mutant, list(order), limit_s)
        if killer in order:
            order.remove(killer)
            order.insert(0, killer)
        return killer


def _first_failure(mutant: Mutant | None, tests: list[str]) -> str | None:
    """In the child: import the mutated module in place of the file's, and run test files one by one."""
    import pytest

    if mutant is not None:
        code, original = mutant.code(), importlib.machinery.SourceFileLoader.get_code

        def get_code(self: Any, fullname: str) -> Any:
            return code if self.path == str(mutant.path) else original(self, fullname)

        importlib.machinery.SourceFileLoader.get_code = get_code  # type: ignore[method-assign]
    for test in tests:
        try:
            if pytest.main([*_OPTIONS, test]) != 0:
                return test
        except BaseException:  # whatever a mutant does is noticed
            return test
    return None


def reasons() -> list[tuple[str, str]]:
    """(pattern, why) of the mutants that draw the same."""
    return [
        (pattern, entry["why"])
        for entry in json.loads(EQUIVALENT.read_text("utf-8"))
        for pattern in entry["mutants"]
    ]


def excused(mutant: Mutant, known: list[tuple[str, str]]) -> str | None:
    """The reason a mutant may survive: its name without the file, or how that begins and a star."""
    name = mutant.name.partition(" ")[2]
    return next((p for p, _ in known if name == p or (p[-1] == "*" and name.startswith(p[:-1]))), None)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("paths", nargs="*", help="patterns of files under scenelang/ (all of TARGETS)")
    parser.add_argument("--share", type=float, default=1.0, help="share of the mutants to run, at random (1)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", default="", metavar="TEXT", help="those whose name holds this")
    parser.add_argument("--list", action="store_true", help="only name them")
    options = parser.parse_args()
    os.chdir(ROOT)
    paths = sorted({p for pattern in TARGETS for p in ROOT.glob(pattern)})
    if options.paths:
        wanted = [f"*{p.removeprefix('scenelang/')}" for p in options.paths]
        paths = [p for p in paths if any(fnmatchcase(str(p), w) for w in wanted)]
    found = [mutant for path in paths for mutant in mutants(path)]
    known = reasons()
    rng = random.Random(options.seed)
    chosen = [m for m in found if rng.random() < options.share and options.only in m.name]
    paths = list(dict.fromkeys(mutant.path for mutant in chosen))
    if options.list:
        print(*(f"{m.line}: {m.name}" for m in chosen), sep="\n")
        return 0
    for name in HEAVY:
        __import__(name)
    runner, start = Runner(), time.monotonic()
    limits: dict[str, int] = {}
    for path in paths:
        tests = runner.tests(next(m for m in chosen if m.path == path))
        if (key := " ".join(sorted(tests))) not in limits:
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            if (failing := runner.killer(None, list(tests), 600)) is not None:
                print(f"{failing} fails without any mutant")
                return 2
            limits[key] = 10 + 3 * int(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)

    def one(mutant: Mutant) -> str | None:
        if excused(mutant, known):
            return "excused"
        killer = runner.judge(mutant, limits[" ".join(sorted(runner.tests(mutant)))])
        if killer is None:
            print(f"survives: line {mutant.line} {mutant.name}", flush=True)
        return killer

    with ThreadPoolExecutor(options.jobs) as pool:
        outcomes = list(pool.map(one, chosen))
    for path in paths:
        of = [o for m, o in zip(chosen, outcomes, strict=True) if m.path == path]
        print(
            f"{path.relative_to(ROOT)}: {len(of)} run, {of.count(None)} survive, "
            f"{of.count('excused')} excused"
        )
    stale = {p for p, _ in known} - {excused(m, known) for m in found}
    if not options.paths and stale:
        print("no such mutants any more:", *sorted(stale), sep="\n  ")
    survivors = outcomes.count(None)
    print(
        f"{len(chosen)} of {len(found)} mutants in {time.monotonic() - start:.0f} s: {survivors} survive, "
        f"{outcomes.count('excused')} excused, {outcomes.count('time')} run out of time"
    )
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
