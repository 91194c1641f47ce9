"""What all tests have in common: nothing of the developer's own brokers reaches them."""

from __future__ import annotations

import atexit
import os
import tempfile

from actors.config import environment


def pytest_configure() -> None:
    """Forget the variables that choose a broker, here and in children, the contexts, and earlier logs."""
    for name in environment.VARIABLES:
        os.environ.pop(name, None)
    folder = tempfile.TemporaryDirectory(prefix="callboard-tests-")
    atexit.register(folder.cleanup)  # pytest's own hook for the end is not called in all workers
    os.environ["XDG_CONFIG_HOME"] = os.environ["XDG_STATE_HOME"] = folder.name
