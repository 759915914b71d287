"""Write what was measured into the manifests of the shipped models.

python -m lab docs manifests            writes scenelang/models/*/manifest.json
python -m lab docs manifests --check    fails where one is out of date

Ranges and what lies beyond them come from docs/results/stability.json (`python -m lab stability`), errors
on each set from docs/results/*.json and docs/results/NAME/*.json (`python -m lab eval`). Models that the
suite was not run on keep the ranges that they were trained in.
"""

from __future__ import annotations

import json
import re
import sys
from typing import Any

from lab import RESULTS
from lab.sets.scenes import sets_of
from lab.stability import measured_ranges
from scenelang.compiler.manifest import ROOT, Manifest, available, load_manifest
from scenelang.drawing.metrics import MOST_DB

BASE = "shapes2d"


def figures(report: dict[str, Any]) -> dict[str, float]:
    """The line of a set."""
    psnr = report["psnr"]
    return {
        "scenes": report["scenes"],
        "psnr": psnr["mean"],
        "psnr_p5": psnr["p5"],
        "psnr_worst": psnr["worst"],
        **({"psnr_uncapped": report["psnr_uncapped"]["mean"]} if "psnr_uncapped" in report else {}),
        "ssim": report["ssim"]["mean"],
        "flip": report["flip"]["mean"],
    }


def manifest(name: str) -> dict[str, Any]:
    """A manifest with everything measured put in."""
    data: dict[str, Any] = json.loads((ROOT / name / "manifest.json").read_text("utf-8"))
    folder = RESULTS if name == BASE else RESULTS / name
    reports = {s: folder / f"{s}.json" for s in sets_of(load_manifest(name))}
    sets = {s: figures(json.loads(p.read_text("utf-8"))) for s, p in reports.items() if p.exists()}
    data["measured"] = {"psnr_cap_db": MOST_DB, "sets": sets} if sets else {}
    suite = RESULTS / ("stability.json" if name == BASE else f"stability-{name}.json")
    if suite.exists():
        ranges, lines = measured_ranges(json.loads(suite.read_text("utf-8")), data["dimension"])
        data["trained"] |= ranges  # a suite may be of few probes, and some ranges have other measurements
        data["measured"]["stability"] = lines
    return data


def text(data: dict[str, Any]) -> str:
    """JSON with lists and small tables on a line each."""
    out = json.dumps(data, indent=2)
    out = re.sub(r"\[\n\s+([^\[\]{}]*?)\n\s+\]", lambda m: "[" + re.sub(r"\s*\n\s*", " ", m[1]) + "]", out)
    flat = re.compile(r'("[a-z0-9-]+"): \{\n\s+([^{}\[\]]*?)\n\s+\}')
    return flat.sub(lambda m: m[1] + ": {" + re.sub(r"\s*\n\s*", " ", m[2]) + "}", out) + "\n"


def main() -> None:
    for name in available():
        path, made = ROOT / name / "manifest.json", text(manifest(name))
        Manifest.from_json(made.encode())  # before it is written
        if "--check" not in sys.argv:
            path.write_text(made, "utf-8")
        elif path.read_text("utf-8") != made:
            raise SystemExit(f"the manifest of {name} is out of date: python -m lab docs manifests")


if __name__ == "__main__":
    main()
