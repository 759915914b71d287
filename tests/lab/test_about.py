"""What records say of the command that made them."""

from __future__ import annotations

import shlex

from lab.about import command_line


def test_folders_are_left_out() -> None:
    for given, said in (
        (
            "eval shapes2d --set chains --scenes 300 -o /tmp/x",
            "eval shapes2d --set chains --scenes 300",
        ),
        ("eval solids3d --kept=/tmp/k --side 256 --out /tmp/x", "eval solids3d --side 256"),
        ("eval solids3d --originals /tmp/x -o y", "eval solids3d --originals FOLDER"),
        ("stability solids3d -o", "stability solids3d"),
        ("eval 'a b.safetensors'", "eval 'a b.safetensors'"),
    ):
        assert command_line(["python -m lab", *shlex.split(given)]) == f"python -m lab {said}"
