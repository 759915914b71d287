"""Scenes drawn in a browser: a view of a scene, the shader that draws it, and the page around it."""
