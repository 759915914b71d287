"""Tables in Markdown, the paper's figures beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lab.docs import paper

Result = Mapping[str, Any]


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def theirs(line: paper.Figures | None) -> list[str]:
    """PSNR, SSIM, LPIPS and FLIP as the paper has them."""
    if line is None:
        return ["–"] * 4
    return [f"{line.psnr:.2f}", f"{line.ssim:.3f}", f"{line.lpips:.3f}", f"{line.flip:.3f}"]
