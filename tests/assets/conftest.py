"""A folder of scenes to run commands in."""

from tests.cli.conftest import folder  # noqa: F401, a fixture
