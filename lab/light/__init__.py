"""Light from everywhere: a path tracer in float64, random scenes, and how near to it renderers come."""
