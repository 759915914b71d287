"""Wrong text: what people meant by it, how it is reported, and what is read in its place."""
