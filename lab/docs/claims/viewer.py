"""Figures in docs/viewer.md."""

from lab.docs.figures import Figure, at

SIDE, OPERATIONS = at("viewer", "side"), at("viewer", "scenes")
MS = {name: Figure(SIDE * SIDE * row["operations"] / 0.5e12 * 1e3) for name, row in OPERATIONS.items()}
KEY = {what: at("play", f"{what}_ms") for what in ("median", "slowest", "drawn")}
CLAIMS = [
    f"of `chain` are about {MS['chain']:.1f} ms of arithmetic there, and of `lotus` {MS['lotus']:.1f} ms",
    f"it takes {KEY['median']:.0f} ms for `chain.nsg` at 256², where {at('play', 'load'):.1f} processes "
    f"want the {at('play', 'cores')} cores: the median of {at('play', 'keys')} keys, in Chromium with "
    f"software GL; the slowest key took {KEY['slowest']:.0f} ms. Compiling and "
    f"drawing are {KEY['drawn']:.0f} ms",
]
GIVEN = {
    "at most 150 KB": "a bound that a test holds",
    "20,000 objects": "a limit",
    "at least 45 dB from `scenelang render` at 128², in space 40": "bounds that a test holds",
    "1 TFLOP/s does 0.5 × 10⁶ multiply-adds": "an example",
    "a minute and 4 GB": "a limit",
    "16,777,216 pixels": "a limit",
}
