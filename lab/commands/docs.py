"""``python -m lab docs``: what is written from records, sources and models."""

from lab.commands import scripts

command = scripts("docs", "make_{}", "Write files of the repository anew")
