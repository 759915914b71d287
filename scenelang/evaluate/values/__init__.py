"""Values of expressions, operators, functions, and the arguments of transforms."""
