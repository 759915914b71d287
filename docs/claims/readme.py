"""Figures in README.md."""

from figures import kilobytes

PLANE, SPACE = kilobytes("models/shapes2d/weights"), kilobytes("models/solids3d/weights")
CLAIMS = [f"({PLANE:.0f} KB of weights for shapes in the plane, {SPACE:.0f} KB for solids)"]
GIVEN = {
    "twenty times as bright": "how the picture was made",
    "190 MB": "the size of a download of PyTorch",
}
