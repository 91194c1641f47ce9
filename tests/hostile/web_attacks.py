"""Attacks of full size on a page; their target is its URL, and its broker's."""

from __future__ import annotations

import socket
import time
from contextlib import ExitStack
from typing import Final
from urllib.parse import urlsplit

from tests.hostile.victims import PAGE, Attack


def connect(page: str) -> socket.socket:
    """Connect to a page without TLS."""
    target = urlsplit(page)
    assert target.hostname is not None
    return socket.create_connection((target.hostname, target.port or 80))


def silent(page: str, _broker: str) -> None:
    """Case 72: connections of one address that say nothing."""
    with ExitStack() as stack:
        for _ in range(600):
            stack.enter_context(connect(page))
        time.sleep(60)


ATTACKS: Final = {"page-silent": Attack(72, silent, victim=PAGE)}
