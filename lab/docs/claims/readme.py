"""Figures in README.md."""

from lab.docs.figures import at, kilobytes

PLANE, SPACE = kilobytes("models/shapes2d/weights"), kilobytes("models/solids3d/weights")
KEPT, DRAWN = at("frontier-verified", "kept") * 100, at("frontier-verified", "drawings")
CLAIMS = [
    f"({PLANE:.0f} KB of weights for shapes in the plane, {SPACE:.0f} KB for solids)",
    f"in {KEPT:.1f} % of {DRAWN:,.0f} drawings of others",
]
GIVEN = {
    "twenty times as bright": "how the picture was made",
    "190 MB": "the size of a download of PyTorch",
}
