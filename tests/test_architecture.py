"""Imports run forward only, along the pipeline of docs/architecture.md, and what is heavy comes late."""

from __future__ import annotations

import ast
import functools
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

from scenelang.language.tables import tables
from tests.mutants import TARGETS

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "scenelang"

# A module may import modules of its own folder, in one direction, and of the folders above.
ORDER = (
    "scenelang.assets",
    "scenelang.language",
    "scenelang.compiler",
    "scenelang.drawing",
    "scenelang.output",
    "scenelang.inverse",
    "scenelang.editors",
    "scenelang.web",
    "scenelang.cli",
)
# The reference defines the training images; what is measured against it may not draw with it.
NEURAL = ("scenelang.drawing.neural", "scenelang.drawing.solid")
FACADES = {"scenelang", "scenelang.__main__"}  # fetch from anywhere, and nothing imports them
LIGHT = ("scenelang.assets", "scenelang.language", "scenelang.compiler", "scenelang.editors", "scenelang.web")
FORBIDDEN = (
    ("scenelang", "lab"),
    *((module, "torch") for module in LIGHT),
    *((module, "scenelang.drawing.exact") for module in NEURAL),
    *(("scenelang.drawing.exact", module) for module in NEURAL),
)


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def imports(path: Path) -> Iterator[tuple[str, int]]:
    """Every module that a file imports anywhere, in functions and for types too, and the line."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno} imports relatively"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield (full if full in MODULES else str(node.module)), node.lineno


@functools.cache
def all_imports() -> list[tuple[str, str, str]]:
    """Every module, what it imports, and where."""
    return [
        (module, target, f"{path.relative_to(ROOT)}:{line} imports {target}")
        for module, path in MODULES.items()
        if module not in FACADES
        for target, line in imports(path)
    ]


def inside(module: str, prefix: str) -> bool:
    return module == prefix or module.startswith(prefix + ".")


def place(module: str) -> int:
    found = [index for index, prefix in enumerate(ORDER) if inside(module, prefix)]
    assert found, f"{module} has no place in ORDER: give it one here and in docs/architecture.md"
    return found[0]


def test_imports_run_forward() -> None:
    inner = [one for one in all_imports() if one[1] in MODULES]
    wrong = [said for module, target, said in inner if place(target) > place(module)]
    assert not wrong, "\n".join(wrong)


def test_no_imports_run_in_a_circle() -> None:
    """Imports for types alone and in functions count: they are read in an order too."""
    graph: dict[str, set[str]] = {}
    for module, target, _ in all_imports():
        if target in MODULES and target != module:
            graph.setdefault(module, set()).add(target)
    TopologicalSorter(graph).prepare()  # raises CycleError, which names one


def test_what_some_may_not_import() -> None:
    """Reference and renderers stay apart, the compiler needs no torch, nothing a facade or the laboratory."""
    wrong = [
        said
        for module, target, said in all_imports()
        for source, forbidden in FORBIDDEN
        if inside(module, source) and inside(target, forbidden)
    ]
    wrong += [said for _, target, said in all_imports() if target == "scenelang"]
    assert not wrong, "\n".join(wrong)


def test_docstring_and_architecture_tell_the_order() -> None:
    """The stages named in the package's docstring, in docs/architecture.md and in ORDER agree."""
    stages = ["language", "compiler", "drawing"]
    docstring = ast.get_docstring(ast.parse((PACKAGE / "__init__.py").read_text("utf-8"))) or ""
    page = (ROOT / "docs/architecture.md").read_text("utf-8")
    headings = re.findall(r"^## \d+\. `(\w+)/`", page, re.MULTILINE)
    assert re.findall(r"``(\w+)``", docstring) == stages
    assert headings == stages
    assert sorted(stages, key=lambda stage: place(f"scenelang.{stage}")) == stages


MOST_LINES, MOST_MODULES = 800, 50
FOLDERS = "scenelang", "tests", "lab", "fuzz"


def test_files_and_folders_stay_small() -> None:
    """A file is read in one go, and a folder's modules are taken in at a glance."""
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    sizes = {path: len(path.read_text("utf-8").splitlines()) for path in files}
    modules = Counter(path.parent for path in files if path.name != "__init__.py")
    wrong = [
        f"{path.relative_to(ROOT)}: {size}, where {most} is the limit"
        for found, most in ((sizes, MOST_LINES), (modules, MOST_MODULES))
        for path, size in found.items()
        if size > most
    ]
    assert not wrong, "\n".join(wrong)


def test_mutants_have_files_and_tests() -> None:
    for pattern, tests in TARGETS.items():
        assert list(ROOT.glob(pattern)), pattern
        assert all((ROOT / test).exists() for test in tests), pattern


def loaded_after(code: str) -> set[str]:
    """Top-level modules that a fresh process has loaded after ``code``."""
    listing = f"{code}\nimport sys\nprint('LOADED', *{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", listing], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.rpartition("LOADED")[2].split())


def loaded_by(*arguments: str) -> set[str]:
    """Top-level modules that a fresh process has loaded after ``scenelang ARGUMENTS``."""
    return loaded_after(
        f"import sys\nfrom scenelang.cli.main import main\nsys.argv = {['scenelang', *arguments]!r}\n"
        "try:\n    main()\nexcept SystemExit as stop:\n    assert not stop.code, stop.code\n"
    )


HEAVY = {"torch", "numpy", "pydantic", "lark", "rich", "PIL", "pygls"}


def test_import_and_loads_load_nothing_heavy() -> None:
    assert not loaded_after("import scenelang") & HEAVY
    code = "import scenelang as nsg; nsg.loads('square {}')"
    assert not loaded_after(code) & (HEAVY - {"pydantic"})


def test_check_loads_no_more_for_solids(tmp_path: Path) -> None:
    """Neither torch nor numpy, and above all not what pydantic needs to build validators."""
    tables()  # made now if the grammar has changed
    scene = tmp_path / "solids.nsg"
    scene.write_text(
        "camera(eye = [1, 2, 5]); light(color = #fed); ground(color = #cba);"
        " subtract { torus; sphere { twist(1); material volumetric { color(#fed); hue(10deg); } } }"
    )
    flat = loaded_by("check", str(ROOT / "examples/night.nsg"))
    assert not flat & {"torch", "numpy", "lark", "distributed"}
    assert loaded_by("check", str(scene)) <= flat


def test_help_loads_nothing_heavy() -> None:
    scene = str(ROOT / "examples/night.nsg")
    for line in ("--help", "render --help", "explain E0401", f"fmt --check {scene}"):
        assert not loaded_by(*line.split()) & HEAVY, line
    assert "pydantic" not in loaded_by("models")


def test_a_program_and_a_small_picture_load_no_torch(tmp_path: Path) -> None:
    for command, output in (("compile", "chain.safetensors"), ("render", "chain.png")):
        arguments = (command, str(ROOT / "examples/chain.nsg"), "-o", str(tmp_path / output))
        assert "torch" not in loaded_by(*arguments)
