"""What all tests have in common: nothing of the developer's own brokers reaches them."""

from __future__ import annotations

import os
import tempfile

import pytest

from actors import environment

_FOLDER: pytest.StashKey[tempfile.TemporaryDirectory[str]] = pytest.StashKey()


def pytest_configure(config: pytest.Config) -> None:
    """Forget the variables that choose a broker, here and in children, the contexts, and earlier logs."""
    for name in environment.VARIABLES:
        os.environ.pop(name, None)
    folder = config.stash[_FOLDER] = tempfile.TemporaryDirectory(prefix="callboard-tests-")
    os.environ["XDG_CONFIG_HOME"] = os.environ["XDG_STATE_HOME"] = folder.name


def pytest_unconfigure(config: pytest.Config) -> None:
    """Leave nothing behind."""
    config.stash[_FOLDER].cleanup()
