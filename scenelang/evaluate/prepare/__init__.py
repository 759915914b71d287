"""Each class of the syntax tree, prepared once into a closure."""
