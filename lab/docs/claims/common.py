"""Numbers of several pages that nothing measured, and why they need no record."""

GIVEN = {
    "Python 3.11": "the oldest version that pyproject.toml allows",
    "4 samples a pixel": "the language's definition of a picture",
    "four samples a pixel": "the language's definition of a picture",
    "64 samples a pixel": "what pictures are compared with where four are not the truth",
    "95 % interval": "the interval's level",
    "PSNR is capped at 50 dB an image": "how PSNR is averaged",
}
