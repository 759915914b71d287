"""Write the table of docs/results.md from the JSON files that ``scenelang eval`` left in docs/results/.

python docs/make_results.py
"""

from __future__ import annotations

import json
import re
from pathlib import Path

HERE = Path(__file__).parent
WHAT = {
    "shapes2d": "1 to 4 deformed objects, 40 % unions, else random booleans",
    "unions": "1 to 4 deformed objects, unions",
    "affine": "the same without deformations",
    "chains": "2 to 4 deformed objects, random booleans",
    "groups": "each object in two nested groups",
    "twelve": "twelve affine steps an object",
    "shuffled": "scale, rotate, translate, shear in random order",
    "tiny": "a tenth of the size",
    "wide": "320 × 192 pixels",
    "tree": "3 or 4 objects in a nested tree that the compiler linearises",
    "deep": "the same with 5 to 8 objects",
    "many": "16 objects",
    "crowd": "100 objects at 0.4 of the size",
    "strong": "deformations up to ±2.4",
    "large": "three times the size",
}
BEGIN, END = "<!-- table: python docs/make_results.py -->", "<!-- end of table -->"


def table() -> str:
    """The Markdown table of all sets that were measured."""
    lines = [
        "| set | what | scenes | PSNR, dB | 5th percentile | worst | SSIM | FLIP | FLIP, 95th percentile |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, what in WHAT.items():
        path = HERE / "results" / f"{name}.json"
        if not path.exists():
            continue
        d = json.loads(path.read_text())
        p, s, f = d["psnr"], d["ssim"], d["flip"]
        lines.append(
            f"| `{name}` | {what} | {d['scenes']:,} | {p['mean']:.2f} | {p['p5']:.2f} | {p['worst']:.2f} "
            f"| {s['mean']:.4f} | {f['mean']:.4f} | {f['p5']:.4f} |"
        )
    return "\n".join(lines)


def main() -> None:
    page = HERE / "results.md"
    text = page.read_text("utf-8")
    pattern = re.escape(BEGIN) + r".*?" + re.escape(END)
    page.write_text(re.sub(pattern, f"{BEGIN}\n{table()}\n{END}", text, flags=re.DOTALL), "utf-8")


if __name__ == "__main__":
    main()
