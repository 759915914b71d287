"""Colours for scene text: a Pygments lexer, and the TextMate grammar that editors use."""
