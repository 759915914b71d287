"""Figures in docs/drawing.md."""

from lab.docs.figures import Figure
from scenelang.drawing.solid.draw import MARCH_SETTINGS
from scenelang.drawing.solid.march import CAREFUL
from scenelang.drawing.work import BOUND_S

FOUR, QUICK, ONE = CAREFUL, MARCH_SETTINGS["quick"], MARCH_SETTINGS["one"]
CLAIMS = [
    f"| `four` | four | {Figure(FOUR.gap)} | {Figure(FOUR.nodes)} |",
    f"; in space where neighbours differ by more than {Figure(FOUR.contrast)} | {Figure(FOUR.gap)} | "
    f"{Figure(FOUR.nodes)} |",
    f"in space four where neighbours differ by more than {Figure(QUICK.contrast)} | {Figure(QUICK.gap)} | "
    f"{Figure(QUICK.nodes)} |",
    f"with hard edges | {Figure(ONE.gap)} | {Figure(ONE.nodes)} |",
    f"2 x 2 pixels, enlarged | {Figure(ONE.gap)} | {Figure(ONE.nodes)} |",
    f"may take {Figure(BOUND_S):.0f} s of processor time",
    f"as `adaptive`, with so many | {Figure(FOUR.gap)} | {Figure(FOUR.nodes)} |",
]
GIVEN = {
    "under 0.002 nobody sees it": "a rule of thumb",
    "what is thinner than 0.01": "the language's definition",
    "lose a shell of 0.03": "what was looked at",
    "2 x 2 pixels": "a setting",
    "256 x 256 pixels": "a setting",
    "four samples for each pixel": "the language's definition of a picture",
}
