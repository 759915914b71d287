"""Inputs that fail, made smaller: what is left fails alike."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable

from fuzz.target import Failure, Target


def signature_of(error: BaseException) -> str:
    """Error and place of a failure: the same for the same mistake."""
    if isinstance(error, Failure):
        return error.oracle
    place = "outside"
    for frame in traceback.extract_tb(error.__traceback__):
        _, inside, rest = frame.filename.rpartition(f"{os.sep}scenelang{os.sep}")
        if inside:
            place = f"{rest}:{frame.name}"
    return f"{type(error).__name__} in {place}"


def failure_of(target: Target, data: bytes) -> str | None:
    """The signature of what an input makes a target raise, None where it raises nothing."""
    try:
        target.check(data)
    except Exception as error:
        return signature_of(error)
    return None


def minimise(data: bytes, shows: Callable[[bytes], bool], tries: int = 3000) -> bytes:
    """A smaller input that still ``shows`` the same: pieces are left out, large ones first."""
    size = max(1, len(data) // 2)
    while size and tries > 0:
        at, smaller = 0, False
        while at < len(data) and tries > 0:
            candidate = data[:at] + data[at + size :]
            tries -= 1
            if shows(candidate):
                data, smaller = candidate, True
            else:
                at += size
        if not smaller:
            size //= 2
    return data
