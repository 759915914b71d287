from __future__ import annotations
from typing import Any
from scenelang.syntax.tokens import Report, Tokens
class Recovery:
    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens=tokens; self.report=report
    def resume(self, states: list[int], values: list[Any], at: int) -> int | None:
        self.report.add("E0101","unexpected text",self.tokens.starts[at],self.tokens.ends[at])
        return None
