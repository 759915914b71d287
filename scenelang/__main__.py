"""``python -m scenelang``."""

from scenelang.cli.main import main

main()
