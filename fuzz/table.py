"""The tables of docs/fuzzing.md, made from the targets and the records: ``python -m fuzz --table``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from fuzz.runner import RECORDS, ROOT
from fuzz.target import PROPERTIES, TARGETS, load_target

PAGE: Final = ROOT / "docs" / "fuzzing.md"


def records(folder: Path = RECORDS) -> list[dict[str, Any]]:
    """All records, oldest first."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]


def targets_table() -> str:
    """What each target holds."""
    rows = ["| target | what must hold |", "|---|---|"]
    rows += [f"| `{name}` | {load_target(name).summary} |" for name in (*TARGETS, PROPERTIES)]
    return "\n".join(rows)


def runs_table(found: list[dict[str, Any]]) -> str:
    """One row a run."""
    rows = [
        "| target | started (UTC) | commit | wall | CPU | executions | edges | features | corpus | memory "
        "| slowest input | findings |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---|",
    ]
    for run in found:
        followed = [f"{run[key]:,}" if run[key] else "–" for key in ("edges", "features", "corpus")]
        slowest = f"{run['slowest']['cpu_s']:.2f} s" if run["slowest"] else "–"
        findings = "; ".join(f"{f['kind']}: {f['signature']}" for f in run["findings"]) or "none"
        cells = [
            f"`{run['target']}`",
            run["started"][:16].replace("T", " "),
            f"`{run['revision'][:7]}`",
            f"{run['wall_s'] / 60:.0f} min",
            f"{run['cpu_s'] / 60:.0f} min",
            f"{run['executions']:,}",
            *followed,
            f"{run['peak_bytes'] / 1e6:.0f} MB",
            slowest,
            findings,
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def page(text: str) -> str:
    """The page with its tables made anew."""
    for name, table in (("targets", targets_table()), ("runs", runs_table(records()))):
        begin, end = f"<!-- {name}: python -m fuzz --table -->", f"<!-- end of {name} -->"
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        text = f"{before}{begin}\n\n{table}\n\n{end}{after}"
    return text


def update() -> None:
    """Write the page."""
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
