"""How a picture may be drawn."""

from __future__ import annotations

from typing import Literal

Backend = Literal["neural", "reference"]
Device = Literal["auto", "cpu", "cuda"]
Samples = Literal["adaptive", "four", "one"]
