"""Imports: what they bring, and what they refuse."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from scenelang.language import statements
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.parser import parse
from tests.language.cases import Outcome, run_text, transform
from tests.work import lines_run


def write(folder: Path, **files: str) -> None:
    for name, text in files.items():
        path = folder / (name.replace("__", "/") + ".nsg")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")


def load(path: Path, **options: Any) -> Outcome:
    found = Diagnostics()
    frame = options.pop("frame", 0)
    scene, spans = Source(path, **options).scene(found, frame)
    return Outcome(scene, spans, found)


LIB = """
param k = 2 in 0..5;
let twice = k * 2;
fn f(x) = x * twice;
module m(x) { square { translate(f(x), 0); } }
star { scale(nonsense); }  // what an imported file draws is its own affair
"""


def test_names_of_another_file(tmp_path: Path) -> None:
    write(
        tmp_path,
        lib=LIB,
        main='import "lib.nsg" as lib; lib.m(1); star { translate(lib.f(2), lib.twice + lib.k); }',
    )
    scene = load(tmp_path / "main.nsg").good()
    assert transform(scene).x == 4
    assert (transform(scene, 1).x, transform(scene, 1).y) == (8, 6)
    scene = load(tmp_path / "main.nsg", params={"lib.k": "3"}).good()
    assert transform(scene).x == 6
    assert load(tmp_path / "main.nsg", params={"k": "3"}).codes == ["E0211"]
    assert load(tmp_path / "main.nsg", params={"lib.k": "9"}).codes == ["E0309"]


def test_imports_of_imports_stay_private(tmp_path: Path) -> None:
    write(tmp_path, a="let x = 3;", sub__b='import "../a.nsg" as a; let y = a.x + 1;')
    write(tmp_path, main='import "sub/b.nsg" as b; square { translate(b.y, 0); }')
    assert transform(load(tmp_path / "main.nsg").good()).x == 4
    write(tmp_path, main='import "sub/b.nsg" as b; square { translate(b.a.x, 0); }')
    assert load(tmp_path / "main.nsg").codes == ["E0212"]


def test_refused(tmp_path: Path) -> None:
    root = tmp_path / "root"
    write(tmp_path, outside="let x = 1;", root__main="")
    (root / "bad.nsg").write_bytes(b"let x = 1; // \xff\xfe")
    (root / "link.nsg").symlink_to(tmp_path / "outside.nsg")
    (root / "loop.nsg").symlink_to(root / "loop.nsg")
    os.mkfifo(root / "pipe")
    wrong = []
    for path, code in (
        ("missing.nsg", "E0214"),
        ("link.nsg", "E0215"),
        ("loop.nsg", "E0214"),
        ("", "E0214"),
        (".", "E0214"),
        ("../outside.nsg", "E0215"),
        ("sub/../../outside.nsg", "E0215"),
        ("/etc/passwd", "E0215"),
        ("C:\\\\x.nsg", "E0215"),
        ("main.nsg", "E0216"),
        ("bad.nsg", "E0214"),
        ("pipe", "E0214"),
    ):
        write(root, main=f'import "{path}" as lib; square {{ translate(lib.x, 0); }}')
        found = [(d.code, d.span and d.span.text) for d in load(root / "main.nsg").diagnostics]
        if found != [(code, f'"{path}"')]:
            wrong.append((path, found))
    assert wrong == []
    write(root, main='import "link.nsg" as lib;')
    load(root / "main.nsg", root=tmp_path).good()


def test_diamonds_do_not_explode(tmp_path: Path) -> None:
    for i in range(30):
        write(tmp_path, **{f"f{i}": f'import "f{i + 1}.nsg" as a; import "f{i + 1}.nsg" as b; let x = 1;'})
    write(tmp_path, f30="let x = 1;")
    load(tmp_path / "f0.nsg").good()
    write(tmp_path, f30="param x = 1;")  # of which each way there makes another one
    assert load(tmp_path / "f0.nsg").codes == ["E0324"]


def test_a_file_without_params_is_prepared_once(tmp_path: Path) -> None:
    """Under any number of names, with the values of its functions and modules, and in every frame."""

    def work(count: int) -> int:
        imports = "".join(f'import "std/shapes" as a{n};\n' for n in range(count))
        return lines_run(lambda: run_text(imports + f"a{count - 1}.disc(0.3);").good())

    work(1)
    assert work(200) < 5 * work(20)
    write(tmp_path, lib='import "deep.nsg" as d; param k = 1; fn f() = k * d.size;', deep="let size = 2;")
    main = 'animate(1, 2); import "lib.nsg" as a; import "lib.nsg" as b; import "deep.nsg" as d;'
    write(tmp_path, main=f"{main} square {{ scale(a.f(), b.f() + d.size); rotate(1turn * u); }}")
    for frame in (0, 1):
        outcome = load(tmp_path / "main.nsg", frame=frame, params={"b.k": "3"})
        assert outcome.good().nodes[0].transforms[0] == nsg.Scale(x=2.0, y=8.0)  # type: ignore[union-attr]


def test_files_that_are_prepared_again_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(statements, "MAX_BYTES", 100)
    write(tmp_path, lib=f"param k = 1; // {'x' * 40}")
    for count, codes in ((2, []), (4, ["E0324"])):
        write(tmp_path, main="".join(f'import "lib.nsg" as a{n};' for n in range(count)))
        assert load(tmp_path / "main.nsg").codes == codes


def test_mistakes_in_an_imported_file_are_shown_there(tmp_path: Path) -> None:
    write(
        tmp_path,
        lib="let x = 1;\nfn f(a) = a + nope;",
        main='import "lib.nsg" as lib; square { scale(lib.f(1)); }',
    )
    found = load(tmp_path / "main.nsg").only()
    assert found.span is not None
    assert found.span.source.name.endswith("lib.nsg")
    assert (found.code, found.span.locate()[0]) == ("E0201", (2, 15))


def test_unknown_names_of_a_file(tmp_path: Path) -> None:
    write(tmp_path, lib="let size = 1; fn f(x) = x; module m() { square {} }")
    use = "square { scale(lib.sise); translate(lib.g(1), 0); } lib.n(); lib.f(1);"
    write(tmp_path, main=f'import "lib.nsg" as lib; {use}')
    outcome = load(tmp_path / "main.nsg")
    assert outcome.codes == ["E0212", "E0212", "E0212", "E0213"]
    assert outcome.diagnostics.items[0].help == "did you mean `size`?"


def test_large_and_odd_files(tmp_path: Path) -> None:
    (tmp_path / "big.nsg").write_text("// " + "x" * 10_000_000)
    assert load(tmp_path / "big.nsg").codes == ["E0324"]
    (tmp_path / "bom.nsg").write_bytes(b"\xef\xbb\xbfnsg 1; square {}")
    load(tmp_path / "bom.nsg").good()
    (tmp_path / "latin.nsg").write_bytes(b"// \xe9")
    assert load(tmp_path / "latin.nsg").codes == ["E0214"]
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "none.nsg")
    with pytest.raises(IsADirectoryError):
        load(tmp_path)


def test_texts_instead_of_files(tmp_path: Path) -> None:
    """What is not saved yet counts; the first file's imports and those of imports too."""
    (tmp_path / "lib.nsg").write_text("let a = 1;")
    given = {(tmp_path / "lib.nsg").resolve(): 'import "new.nsg" as new; let a = new.b;'}
    given[(tmp_path / "new.nsg").resolve()] = "let b = 0.25;"
    found = Diagnostics()
    text = 'import "lib.nsg" as lib; square { translate(lib.a, 0); }'
    tree = parse(SourceFile("a.nsg", text), found)
    scene, _ = Source(tmp_path / "a.nsg", tree=tree, texts=given).scene(found)
    assert scene is not None, list(found)
    assert scene.nodes[0].transforms[0].x == 0.25


def test_a_cycle_shows_each_import_on_the_way(tmp_path: Path) -> None:
    write(tmp_path, a='import "b.nsg" as b;', b='import "c.nsg" as c;', c='import "b.nsg" as b;')
    found = load(tmp_path / "a.nsg").only()
    assert (found.code, found.message) == ("E0216", "import cycle: b.nsg → c.nsg → b.nsg")
    assert found.span is not None
    assert Path(found.span.source.name).name == "c.nsg"
    assert [(Path(x.span.source.name).name, x.span.text) for x in found.labels] == [("b.nsg", '"c.nsg"')]
    write(tmp_path, a='import "a.nsg" as a;')
    assert load(tmp_path / "a.nsg").only().labels == ()
