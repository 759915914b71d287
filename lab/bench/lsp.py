"""Cost of a keystroke: ``python -m lab bench lsp [LINES] [KEYS]``.

A server process is driven over its pipes, as an editor drives it: a statement is typed in the middle of a
file. Wall clock from the first byte sent to the last byte read:

- syntax: from ``didChange`` to the ``publishDiagnostics`` with the mistakes of syntax;
- completion: from ``didChange`` to the answer of a completion right behind it;
- check: from the last key to the ``publishDiagnostics`` with all mistakes, less the pause (``debounceMs``).

Files of many small statements are typed into with and without closing braces by themselves: while a brace is
open, the layout of the whole text decides where it belongs. One long chain is parsed whole in any case.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Iterator
from itertools import islice

from tests.editors.client import Client

TYPED = "star { scale(0.25); rotate(30deg); translate(0.1, 0.2); material flat { color(#d33); } }\n"
DEBOUNCE_MS = 50


def modules(lines: int) -> str:
    """A file of modules and their calls."""
    return "nsg 1;\n" + "".join(
        f"// part {i}\n"
        f"module part{i}(phase, c = #e8c060) {{\n"
        "  star {\n"
        f"    scale(0.22 + phase / {i + 3}); rotate(0.2turn * phase);\n"
        "    translate(0.1, 0.16 * abs(sin(phase * 1turn)));\n"
        "    material flat { color(mix(c, [1, 1, 1], 0.5)); }\n"
        "  }\n"
        "}\n"
        f"part{i}(phase = 0.{i}, c = #a{i % 10}{i % 7});\n"
        for i in range(lines // 9)
    )


def chain(lines: int) -> str:
    """A file of one long chain."""
    rows = [
        f"  {'smooth ' if i % 3 else ''}square {{ scale({0.1 + i / 1e4:.4f}); translate(0, 0.{i}); }}\n"
        for i in range(lines - 3)
    ]
    return "nsg 1;\nchain {\n" + "".join(rows) + "}\n"


def keys(closing: bool) -> Iterator[tuple[int, str]]:
    """Text that each key inserts, and its place; with ``closing`` a brace brings its other half."""
    for at, letter in enumerate(TYPED):
        if closing and letter == "}":
            continue  # it is there: the cursor steps over it
        yield at, "{}" if closing and letter == "{" else letter


def measure(text: str, at: int, count: int, closing: bool) -> dict[str, list[float]]:
    """Times in ms of the first ``count`` keys typed at an offset."""
    client = Client(options={"debounceMs": DEBOUNCE_MS})
    result: dict[str, list[float]] = {"syntax": [], "completion": [], "check": []}
    try:
        uri = client.open("untitled:bench", text)
        client.diagnostics(uri, 120)
        for number, (shift, new) in enumerate(islice(keys(closing), count)):
            start = time.perf_counter()
            client.change(uri, at + shift, at + shift, new)
            request = client.start("textDocument/completion", _behind(client, uri, at + shift + 1))
            client.next_diagnostics(uri)
            result["syntax"].append(1000 * (time.perf_counter() - start))
            client.answer(request)
            result["completion"].append(1000 * (time.perf_counter() - start))
            if number % 8 == 7:
                client.diagnostics(uri, 120)
                result["check"].append(1000 * (time.perf_counter() - start) - DEBOUNCE_MS)
        assert client.stop() == 0
    finally:
        client.kill()
    return result


def _behind(client: Client, uri: str, offset: int) -> dict[str, object]:
    return {"textDocument": {"uri": uri}, "position": client.position(client.texts[uri], offset)}


def main() -> None:
    """Print the table."""
    lines = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    count = int(sys.argv[2]) if len(sys.argv) > 2 else len(TYPED)
    parts, long = modules(lines), chain(lines)
    between = parts.index("\n// part", len(parts) // 2) + 1
    cases = (
        ("modules, braces closed", parts, between, True),
        ("modules, braces open", parts, between, False),
        ("one chain, braces closed", long, long.index("\n", len(long) // 2) + 1, True),
    )
    print(f"{f'{lines:,} lines':<26}{'':<12}{'keys':>6}{'median ms':>12}{'95 % ms':>10}{'worst ms':>10}")
    for name, text, at, closing in cases:
        for what, times in measure(text, at, count, closing).items():
            times.sort()
            tail = times[min(len(times) - 1, round(0.95 * len(times)))]
            middle = statistics.median(times)
            print(f"{name:<26}{what:<12}{len(times):>6}{middle:>12.1f}{tail:>10.1f}{times[-1]:>10.1f}")


if __name__ == "__main__":
    main()
