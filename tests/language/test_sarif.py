"""SARIF logs keep to the parts of the 2.1.0 schema that scenelang uses; nothing outside them is written."""

from __future__ import annotations

import json
import os
from typing import Any
from urllib.parse import unquote

import jsonschema
import pytest

from scenelang.language.diagnostics import Diagnostic, Edit, Fix, Label, SourceFile, Span
from scenelang.language.machine import render_github, render_sarif
from scenelang.language.pages import CODES, read_page


def shape(required: list[str], **properties: Any) -> dict[str, Any]:
    """An object of the schema: these properties and no others."""
    return {
        "type": "object",
        "required": required,
        "properties": properties,
        "additionalProperties": False,
    }


def many(items: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"type": "array", "items": items, **more}


# Trimmed from the OASIS schema of SARIF 2.1.0: types, required properties, bounds and enumerations as there.
TEXT = {"type": "string"}
COUNT = {"type": "integer", "minimum": 0}
PLACE = {"type": "integer", "minimum": 1}
LEVEL = {"enum": ["none", "note", "warning", "error"]}
MESSAGE = shape(["text"], text=TEXT)
FILE = shape([], uri={"type": "string", "format": "uri-reference"})
REGION = shape([], startLine=PLACE, startColumn=PLACE, endLine=PLACE, endColumn=PLACE)
LOCATION = shape(
    [],
    id={"type": "integer", "minimum": -1},
    physicalLocation=shape([], artifactLocation=FILE, region=REGION),
    message=MESSAGE,
)
RULE = shape(
    ["id"],
    id=TEXT,
    shortDescription=MESSAGE,
    fullDescription=MESSAGE,
    help=shape(["text"], text=TEXT, markdown=TEXT),
    defaultConfiguration=shape([], level=LEVEL),
    properties=shape([], tags=many(TEXT, uniqueItems=True)),
)
CHANGE = shape(
    ["artifactLocation", "replacements"],
    artifactLocation=FILE,
    replacements=many(
        shape(["deletedRegion"], deletedRegion=REGION, insertedContent=shape([], text=TEXT)), minItems=1
    ),
)
RESULT = shape(
    ["message"],
    ruleId=TEXT,
    ruleIndex={"type": "integer", "minimum": -1},
    level=LEVEL,
    message=MESSAGE,
    locations=many(LOCATION),
    relatedLocations=many(LOCATION, uniqueItems=True),
    fixes=many(
        shape(["artifactChanges"], description=MESSAGE, artifactChanges=many(CHANGE, minItems=1)),
        uniqueItems=True,
    ),
)
DRIVER = shape(["name"], name=TEXT, version=TEXT, rules=many(RULE, uniqueItems=True))
RUN = shape(
    ["tool"],
    tool=shape(
        ["driver"], driver=shape(["name"], name=TEXT, version=TEXT, rules=many(RULE, uniqueItems=True))
    ),
    columnKind={"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
    results=many(RESULT),
    properties=shape([], errors=COUNT, warnings=COUNT, fixable=COUNT),
)
LOG = shape(["version", "runs"], **{"$schema": TEXT, "version": {"const": "2.1.0"}, "runs": many(RUN)})

ONE = SourceFile("dir/a b.nsg", "square {\n  rotate(45)\n}\n")
OTHER = SourceFile("lib.nsg", "fn f(x) = x;\n")
AT, END = Span(ONE, 18, 20), Span(ONE, 21, 21)
ALL = [
    Diagnostic("E0302", "a bare number", AT, fix=Fix("add `deg`", (Edit(Span(ONE, 20, 20), "deg"),))),
    Diagnostic("E0102", "missing `;`", END, (Label(Span(OTHER, 3, 4), "here"),), "help"),
    Diagnostic("W0501", "too many", None),
    Diagnostic("E0330", "over lines", Span(ONE, 0, 23)),
]


def log(found: list[Diagnostic]) -> Any:
    data = json.loads(render_sarif(found, "1.2.3"))
    jsonschema.validate(data, LOG)
    return data["runs"][0]


def test_it_keeps_to_the_schema() -> None:
    run = log(ALL)
    assert len(run["results"]) == 4
    assert run["properties"] == {"errors": 3, "warnings": 1, "fixable": 1}
    assert log([])["results"] == []


def test_rules_carry_their_pages() -> None:
    rules = log([Diagnostic(code, "m", AT) for code in CODES])["tool"]["driver"]["rules"]
    assert {rule["id"] for rule in rules} == set(CODES)
    for rule in rules:
        page = read_page(rule["id"])
        assert rule["shortDescription"]["text"] == page.title
        assert rule["help"]["markdown"] == page.text
        assert page.examples[0].text.splitlines()[0] in rule["help"]["text"]
        assert rule["defaultConfiguration"]["level"] == page.severity
        assert rule["fullDescription"]["text"] in " ".join(page.text.split())


def test_fixes_and_places_say_the_same_as_the_text() -> None:
    result = next(r for r in log(ALL)["results"] if r["ruleId"] == "E0302")
    change = result["fixes"][0]["artifactChanges"][0]
    assert unquote(change["artifactLocation"]["uri"]) == ONE.name
    assert change["replacements"] == [
        {
            "deletedRegion": {"startLine": 2, "startColumn": 12, "endLine": 2, "endColumn": 12},
            "insertedContent": {"text": "deg"},
        }
    ]


def test_names_are_relative_to_the_working_folder() -> None:
    """Code scanning matches them with the files of a repository."""
    for name, uri in {
        os.path.join(os.getcwd(), "dir", "ä b.nsg"): "dir/%C3%A4%20b.nsg",
        "/elsewhere/a.nsg": "file:///elsewhere/a.nsg",
        "<stdin>": "%3Cstdin%3E",
    }.items():
        found = Diagnostic("E0302", "m", Span(SourceFile(name, "x"), 0, 1))
        place = log([found])["results"][0]["locations"][0]["physicalLocation"]
        assert place["artifactLocation"]["uri"] == uri
    inside = os.path.join(os.getcwd(), "a.nsg")
    shown = render_github([Diagnostic("E0302", "m", Span(SourceFile(inside, "x"), 0, 1))])
    assert shown.startswith("::error file=a.nsg,line=1,")


def test_the_schema_can_fail() -> None:
    data = json.loads(render_sarif(ALL))
    del data["runs"][0]["results"][0]["message"]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, LOG)
