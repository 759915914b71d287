"""``python -m scenelang``."""

from scenelang.cli.start import main

main()
