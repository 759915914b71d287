"""Writes ``docs/errors.md``, the index of all codes, from their pages: ``python -m lab docs errors``."""

from __future__ import annotations

from lab import DOCS
from scenelang.language.pages import AREAS, CODES, read_page

TARGET = DOCS / "errors.md"
_PAGES = "../scenelang/language/pages"

_HEAD = """\
# Errors and warnings

A diagnostic has a code that never changes its meaning: `E` for an error, with which no picture is made, `W`
for a warning. The page of a code says what it means, why it is one, and what to write instead; `explain`
shows the same text:

```sh
scenelang explain E0302
scenelang explain --list
```

## Reading one

```text
error[E0302]: expected an angle, found a bare number
 --> scene.nsg:1:17
  |
1 | square { rotate(45); }
  |                 ^^
  |
  = help: give it a unit: deg, rad or turn
  = fix: add `deg`
  |
1 | square { rotate(45deg); }
  |                   +++
```

The carets mark the mistake, dashes mark other places that belong to it, and the last lines show what the fix
would change.

## Fixing

```sh
scenelang check scene.nsg --diff
scenelang check scene.nsg --fix
```

`--diff` shows what `--fix` would write. A fix is safe to apply unseen: it says what the text can only have
meant, or leaves the picture as it is. Fixes are applied until none is left. Imported files change only if
they are named, too. `-` stands for standard input and output.

## Choosing

```sh
scenelang check scene.nsg --ignore W0201,W05
scenelang check scene.nsg --select W03 --strict
scenelang check film.nsg --all-frames
```

Of an animation `check` evaluates the first, second, middle and last frame, or all, or one (`--frame N`).
Together they may take as many steps and objects as one.

Errors always count. Warnings can be left out or chosen by their codes or beginnings of them, and `--strict`
lets them fail the check. The exit code is 0 without errors, 1 with, 2 where a file cannot be read.

## For other programs

```sh
scenelang check scene.nsg --format json
scenelang check scene.nsg --format sarif
scenelang check scene.nsg --format github
scenelang check scene.nsg --format concise
```

| format | for |
|---|---|
| `json` | scripts: `{"version": 1, "diagnostics": […]}`, places in lines and columns from 1, fixes as edits |
| `sarif` | code scanning: a SARIF 2.1.0 log with each rule's page and all fixes |
| `github` | annotations beside the lines of a pull request |
| `concise` | editors and `grep`: `file:line:column: error[CODE] message` |

Columns count code points, and the end of a place is the column behind it.

## All codes
"""


def index() -> str:
    """The text of the page."""
    parts = [_HEAD]
    for area, name in AREAS.items():
        parts.append(f"\n### {name[0].upper()}{name[1:]}\n\n| code | |\n|---|---|\n")
        for code in (code for code in CODES if code[1:3] == area):
            page = read_page(code)
            parts.append(f"| [{code}]({_PAGES}/{code}.md) | {page.title} |\n")
    return "".join(parts)


if __name__ == "__main__":
    TARGET.write_text(index(), "utf-8")
