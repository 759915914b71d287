"""Animated scenes that reuse could get wrong, each in its own way."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]

HEAD = "animate(seconds = 1, fps = 6);\n"
DARK = "background(#1d2233);\n"
TRICKY = {
    "all of it moves": "square { scale(0.3); rotate(0.25turn * u); }",
    "nothing moves": "square { scale(0.3); } group { star; scale(0.2); }",
    "a let between": "let a = u; let b = 2 * a; star { scale(0.2 + 0.1 * b); } square { scale(0.1); }",
    "a function": "fn f(x) = x * g(); fn g() = 1 - u / 2; star { scale(f(0.5)); } square { scale(0.1); }",
    "a function of a later let": "fn f() = k; let k = 0.2 + u / 4; square { scale(f()); }",
    "a module": "module m(x) { star { scale(x); rotate(1turn * t / 5); } } m(0.4); group { m(0.2); }",
    "a module that stays": "module m(x) { star { scale(x); } } m(0.4); group { m(u + 0.1); }",
    "a name that hides t": """module m(t) { star { scale(t); } }
      m(0.4); for (u in [0.1, 0.2]) { star { scale(u); } }""",
    "a loop in a group": """group {
      for (i in 0..<4) { star { scale(0.1); translate(0.5, 0); rotate(90deg * i); } }
      square { scale(0.1); }
      rotate(1turn * u);
    }""",
    "a choice": """if (frame < 3) { square { scale(0.3); } }
      else { star { scale(0.3); } } pentagon { scale(0.1); }""",
    "a part that comes late": """if (frame > 2) { group { for (i in 0..<3) { star { scale(0.1 * (i + 1));
      } } } }""",
    "transforms stay, children move": """group { star { scale(0.2 + u / 5); } translate(0.2, 0);
      rotate(30deg); }""",
    "children stay, transforms come": """group { star { scale(0.3); } if (u > 0.4) { translate(0.3, 0);
      } rotate(9deg); }""",
    "a material": """let red = material flat { color(#d33); };
      let warm = material flat { color(hsv(u, 0.5, 1)); };
      group { square { scale(0.4); } star { scale(0.2); warm; } red; }
      pentagon { scale(0.1); red { grayscale(u); } }""",
    "settings": "canvas(16 + 8 * (frame % 2), 16); background([u, 0.5, 1]); square { scale(0.5); }",
    "a chain": """chain {
      square { scale(0.6); }
      if (u > 0.3) { smooth star { scale(0.5); } }
      subtract pentagon { scale(0.2); translate(0.3 * u, 0); }
    }""",
    "warps": "star { twirl(u); scale(0.4); bend(0.2); rotate(10deg); } square { bend(0.3); scale(0.2); }",
    "hidden and seen": """star { scale(0.2); } square { scale(0.1 + 0.5 * u); }
      pentagon { translate(5 * u, 0); }""",
    "a param": """param n = 3; for (i in 0..<n) { star { scale(0.1); translate(0.2 * i, u); } }
      square { scale(n / 9); }""",
    "a param of u": "param k = u; square { scale(0.2 + k / 9); }",
    "loops of lets": """for (i in 0..<3) { let a = i / 9 + 0.1; let b = a + u / 9;
      star { scale(b); } square { scale(a); } }""",
    "once more": "star { scale(0.2 + 0.2 * abs(sin(1turn * u))); }",
}


def tricky(name: str) -> str:
    """The text of one of `TRICKY`."""
    text = TRICKY[name]
    return HEAD + ("" if "background" in text else DARK) + text


def examples() -> list[Path]:
    """The examples that are animations."""
    return [p for p in sorted((ROOT / "examples").glob("*.nsg")) if "\nanimate(" in p.read_text("utf-8")]
