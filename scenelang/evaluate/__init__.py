"""From the syntax tree to a Scene."""
