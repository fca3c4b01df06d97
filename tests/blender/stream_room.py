"""The fixture by which tests of streams reach the scene's modules; for files that import it."""

import importlib

import pytest
from conftest import EXTENSION


@pytest.fixture
def room():
    """Import modules of the scene by name; no stream and no rally is left open."""
    found = lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")  # noqa: E731
    yield found
    found("stream.play").stop_rally()
    found("stream.follow").stop_listening()
    found("stream.follow").write_stopped()
