"""Each class of the syntax tree, prepared once into a closure.

The two tables say which function prepares which class. The functions call each other by way of them: the
`Session` hands them down, so that none imports what it may hold.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from scenelang.evaluate.prepare import (
    blocks,
    calls,
    heads,
    materials,
    operations,
    params,
    references,
    settings,
)
from scenelang.evaluate.prepare import nodes as scene_nodes
from scenelang.syntax import nodes

EXPRESSIONS: Final[Mapping[type, Callable[..., Any]]] = {
    nodes.Number: operations.prepare_number,
    nodes.String: operations.prepare_literal,
    nodes.Bool: operations.prepare_literal,
    nodes.Color: operations.prepare_color,
    nodes.Vector: operations.prepare_vector,
    nodes.Range: operations.prepare_range,
    nodes.NameRef: references.prepare_name,
    nodes.Unary: operations.prepare_unary,
    nodes.Binary: operations.prepare_binary,
    nodes.Conditional: operations.prepare_conditional,
    nodes.CallExpr: calls.prepare_call,
    nodes.Member: references.prepare_member,
    nodes.Index: operations.prepare_index,
    nodes.MaterialExpr: materials.prepare_material,
    nodes.BadExpr: operations.skip_bad,
}
STATEMENTS: Final[Mapping[type, Callable[..., Any]]] = {
    nodes.Version: settings.prepare_version,
    nodes.Model: settings.prepare_model,
    nodes.Param: params.prepare_param,
    nodes.Let: blocks.prepare_let,
    nodes.Fn: blocks.skip,
    nodes.Module: blocks.skip,
    nodes.Import: settings.prepare_import,
    nodes.For: blocks.prepare_for,
    nodes.If: blocks.prepare_if,
    nodes.Call: heads.prepare_headed,
    nodes.Node: scene_nodes.prepare_node,
    nodes.Combined: scene_nodes.prepare_combined,
    nodes.MaterialUse: materials.prepare_use,
    nodes.BadStmt: blocks.skip,
}
