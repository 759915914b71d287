"""``python -m scenelang``."""

from __future__ import annotations

from scenelang.cli.start import main

main()
