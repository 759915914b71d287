"""`scenelang explain`: pages, lists, near codes, JSON."""

from __future__ import annotations

import json
import re

from scenelang.language.pages import CODES, read_page
from scenelang.language.reports import paint
from tests.cli.conftest import Folder


def test_a_page(folder: Folder) -> None:
    result = folder.run("explain", "E0302")
    assert result.exit_code == 0
    assert result.stdout.startswith("error[E0302]: bare number where an angle is wanted\n\n")
    assert "\n    square { rotate(45); }\n" in result.stdout
    assert "```" not in result.stdout
    assert "#" not in result.stdout
    assert "\x1b" not in result.stdout


def test_files_beside_an_example_are_named(folder: Folder) -> None:
    assert "\n    parts.nsg:\n    import" in folder.run("explain", "E0216").stdout


def test_codes_about_a_word(folder: Folder) -> None:
    shown = folder.run("explain", "semicolon").stdout
    assert re.findall(r"[EW]\d{4}", shown) == ["E0102", "E0130", "W0101"]
    for word in ("colour", "Color"):
        assert {"E0118", "E0301", "E0330", "W0301"} <= set(
            re.findall(r"[EW]\d{4}", folder.run("explain", word).stdout)
        )


def test_json(folder: Folder) -> None:
    data = json.loads(folder.run("explain", "E0309", "--format", "json").stdout)
    assert (data["version"], data["code"], data["severity"]) == (1, "E0309", "error")
    assert data["title"] == "param outside its range"
    assert data["text"].startswith("# E0309: ")
    assert [example["kind"] for example in data["examples"]] == ["bad", "good"]
    assert data["examples"][0]["options"] == ["-D", "size=7"]
    listed = json.loads(folder.run("explain", "--format", "json").stdout)
    assert [item["code"] for item in listed["codes"]] == list(CODES)


def test_colour(folder: Folder) -> None:
    assert "\x1b[1;31m" in folder.run("explain", "E0302", "--color", "always").stdout
    assert "\x1b" not in folder.run("explain", "E0302", "--color", "never").stdout


def test_every_page_reads_well_in_a_terminal() -> None:
    for page in map(read_page, CODES):
        text = page.plain(60)
        assert not re.search(r"```|^#|<!--|\]\(|[ \t]$", text, re.MULTILINE), page.code
        prose = [line for line in text.splitlines()[1:] if not line.startswith("    ")]
        assert all(len(line) <= 60 for line in prose if " " in line), page.code
        assert all(example.text.splitlines()[0] in text for example in page.examples), page.code
        colored = page.plain(60, lambda text, style: paint(style, text, True))
        assert re.sub(r"\x1b\[[\d;]*m", "", colored) == text


def test_lists_and_codes_as_they_were_printed(folder: Folder) -> None:
    for arguments in ((), ("--list",), ("E0302", "--list")):
        shown = folder.run("explain", *arguments).stdout
        assert re.findall(r"^  ([EW]\d{4})  ", shown, re.MULTILINE) == list(CODES)
        assert shown.startswith("syntax\n  E0101")
    for given in ("e0302", " E0302", "error[E0302]", "[E0302]:"):
        assert folder.run("explain", given).stdout == folder.run("explain", "E0302").stdout
    for wrong, advice in (("E9302", "Did you mean"), ("rumba", "--list"), ("", "--list")):
        result = folder.run("explain", wrong)
        assert (result.exit_code, advice in result.stderr) == (2, True)
