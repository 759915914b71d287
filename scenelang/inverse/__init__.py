"""From pictures back to scenes: the values of params whose picture comes nearest to a target."""
