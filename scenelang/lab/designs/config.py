"""Configurations of studies that yield a model's weights."""

from __future__ import annotations

from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass as checked

from scenelang.lab.designs.studies import StudyConfig
from scenelang.training.config import config_data


@checked(frozen=True, config={"extra": "forbid"})
class StudentFile:
    """A model of another renderer or lifting, trained by a study.

    Args:
        model: name of the model that the weights are for.
        study: what is trained.
    """

    model: str
    study: StudyConfig


def read_student(name: str) -> StudentFile:
    """Read a configuration by path or by the name of a shipped one.

    Raises:
        OSError: there is no such file, or it cannot be read.
        pydantic.ValidationError: a key is unknown or a value has the wrong type.
    """
    return TypeAdapter[StudentFile](StudentFile).validate_json(config_data(name))
