"""Functions of the system that tests replace; everything else that a test changes is an argument."""

from __future__ import annotations

import errno
import math
import os
import socket
import tempfile
import time
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from actors.graph import inspector
from broker.serving import connection, periodic_check

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest

    from broker.access.origin import Origin


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


def change_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the other end of every local socket belong to another user, for the broker."""
    monkeypatch.setattr(connection, "is_same_user", lambda _: False)


def change_origin(monkeypatch: pytest.MonkeyPatch, origin: Origin) -> None:
    """Let further connections to brokers come from somewhere: tests have no other machine."""
    monkeypatch.setattr(connection, "origin_of", lambda _: origin)


def count_returned_memory(monkeypatch: pytest.MonkeyPatch) -> list[None]:
    """Return a list that gets an item whenever free memory is returned to the system, which is not done."""
    returned: list[None] = []
    monkeypatch.setattr(periodic_check, "return_memory", lambda: returned.append(None))
    return returned


def forbid_sockets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no socket be made, as a sandbox may."""

    def forbidden(*_: object) -> None:
        raise OSError(errno.EAFNOSUPPORT, os.strerror(errno.EAFNOSUPPORT))

    monkeypatch.setattr(socket, "socket", forbidden)


def stop_inspectors(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Stop the clock of inspectors; return a function that lets all their deadlines pass."""
    now = [0.0]
    monkeypatch.setattr(inspector, "time", SimpleNamespace(monotonic=lambda: now[0]))
    return partial(now.__setitem__, 0, math.inf)


def move_wall_clock(monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    """Move the clock that `time.time_ns` reads."""
    now = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: now() + round(seconds * 1e9))
