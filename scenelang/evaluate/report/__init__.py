"""Which mistakes have one cause and are reported once, and what is advised."""
