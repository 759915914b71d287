"""Scenes with ``animate(…)`` as numbered pictures, GIF, WebP, APNG and video.

In order: `targets` says what a file name asks for, `clip` compiles frames, `store` keeps those that are
drawn, `painting` and `workers` draw them, `gif`, `apng`, `webp` and `video` encode them, `run` ties it up.
"""
