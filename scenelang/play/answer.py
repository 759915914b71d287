"""Results of jobs, as processes send them."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from scenelang.records import Record


class JobFailed(Exception):
    """A job came to nothing; the message says why."""


class Answer(Record):
    """Result of a job.

    Args:
        data: what the page is sent.
        head: what the server has to know.
    """

    data: bytes
    head: dict[str, Any] = field(default_factory=dict)
