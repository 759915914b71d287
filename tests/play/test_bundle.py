"""The editor in the wheel is what its lock file says, and says whose work it is."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE, WEB = ROOT / "editors/playground", ROOT / "scenelang/web/editor"


def test_the_bundle_is_made_of_the_locked_packages() -> None:
    head, _, code = (WEB / "codemirror.js").read_text("utf-8").partition(" */\n")
    said = dict(line.split() for line in head.splitlines()[1:])
    for name in ("package-lock.json", "codemirror.js"):
        assert said.pop(name) == sha256((SOURCE / name).read_bytes()).hexdigest(), "run build.mjs again"
    assert said.pop("code") == sha256(code.encode()).hexdigest(), "the bundle was changed by hand"
    locked = json.loads((SOURCE / "package-lock.json").read_text("utf-8"))["packages"]
    assert said == {name: locked[f"node_modules/{name}"]["version"] for name in said}
    assert said.keys() >= {*re.findall(r'from "(.+)"', (SOURCE / "codemirror.js").read_text("utf-8"))}
    licences = (WEB / "codemirror.LICENSE.txt").read_text("utf-8")
    assert all(f"{name} {number} (MIT)" in licences for name, number in said.items())
    assert licences.count("Permission is hereby granted") == len(said)


def test_versions_are_exact() -> None:
    package = json.loads((SOURCE / "package.json").read_text("utf-8"))
    asked = package["dependencies"] | package["devDependencies"]
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", number) for number in asked.values())


def test_scenes_to_start_from_are_the_examples() -> None:
    shipped = sorted((WEB / "examples").glob("*.nsg"))
    assert shipped
    for path in shipped:
        assert path.read_bytes() == (ROOT / "examples" / path.name).read_bytes()
