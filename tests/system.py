"""Functions of the system that tests replace; everything else that a test changes is an argument."""

from __future__ import annotations

import errno
import os
import tempfile
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pytest


def fill_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let temporary files be made, and nothing be written to them."""
    make = tempfile.NamedTemporaryFile

    def refuse(_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def full(*args: Any, **options: Any) -> Any:
        file = make(*args, **options)
        monkeypatch.setattr(file, "write", refuse)
        return file

    monkeypatch.setattr(tempfile, "NamedTemporaryFile", full)
