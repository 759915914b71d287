"""Fuzzing of everything that reads what strangers wrote: ``python -m fuzz TARGET --minutes 60``.

A target turns bytes into one use of the library and holds the outcome against oracles; see
`fuzz.target.Target`. The runner drives it with atheris, which follows coverage, and writes a record of the
run. The tests drive the same targets over their seeds and a few hundred mutations, without atheris.
"""
