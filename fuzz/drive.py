"""The process that fuzzes: ``python -m fuzz.drive TARGET FOLDER SEED [libFuzzer options]``.

All of scenelang is imported inside atheris's instrumentation, also what the library itself imports only
when it is needed; what is imported later would be invisible to the fuzzer.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time
from pathlib import Path
from random import Random

OWN_SHARE = 0.7
"""Share of mutations that know the structure; the others are libFuzzer's."""
SLOW_S = 10.0
"""CPU seconds of one input that are a finding; watched code takes three to five times as long as plain."""
LEFT_OUT = ("scenelang.cli", "scenelang.__main__")


def main(name: str, folder: Path, seed: int, options: list[str]) -> None:
    """Fuzz until libFuzzer ends the process."""
    try:
        import atheris  # type: ignore[import-untyped]
    except ImportError:
        raise SystemExit("fuzzing needs atheris: pip install 'scenelang[fuzz]'") from None

    hook = atheris.instrument_imports(include=["scenelang"])
    # Branches are followed, operands of comparisons are not: that takes four times as long, and the
    # dictionaries and mutations know the words.
    hook._trace_dataflow = False
    with hook:
        import scenelang

        for module in pkgutil.walk_packages(scenelang.__path__, "scenelang."):
            if not module.name.startswith(LEFT_OUT):
                try:
                    importlib.import_module(module.name)
                except ImportError:
                    continue  # needs an extra that is not installed here
        from fuzz.target import hold, load_target

        target = load_target(name)

    def mutate(data: bytes, most: int, seed: int) -> bytes:
        generator = Random(seed)
        if generator.random() > OWN_SHARE:
            mutated: bytes = atheris.Mutate(data, most)
            return mutated
        for _ in range(1 + (generator.random() < 0.3)):
            data = target.mutate(data, generator)
        return data[:most]

    def one(data: bytes) -> None:
        before_s = time.process_time()
        target.check(data)
        hold(time.process_time() - before_s < SLOW_S * target.runs, "too much processor time", data[:80])

    words = folder / "dictionary.txt"
    entries = [_quoted(word) for word in target.dictionary() if word]
    words.write_text("\n".join(entries) + "\n", encoding="ascii")
    if entries:
        options = [f"-dict={words}", *options]
    command = [
        sys.argv[0],
        *options,
        f"-max_len={target.most_bytes}",
        f"-seed={seed}",
        str(folder / "corpus"),
    ]
    atheris.Setup(command, one, custom_mutator=mutate)
    atheris.Fuzz()


def _quoted(word: bytes) -> str:
    """A dictionary entry as libFuzzer reads it."""
    return '"' + "".join(f"\\x{byte:02x}" for byte in word) + '"'


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
