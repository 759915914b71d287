"""Figures in docs/viewer.md."""

CLAIMS: list[str] = []
GIVEN = {
    "at most 150 KB": "a bound that a test holds",
    "each thousand objects may add 120 KB": "a bound that a test holds",
    "the light from everywhere 600 KB": "a bound that a test holds",
    "20,000 objects": "a limit",
    "at least 45 dB from `scenelang render` at 128², in space 40": "bounds that a test holds",
    "a minute and 4 GB": "a limit",
    "16,777,216 pixels": "a limit",
}
