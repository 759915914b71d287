"""``python -m lab bench``: benchmarks of parts of the package."""

from lab.commands import scripts

command = scripts("bench", "{}", "Run a benchmark")
