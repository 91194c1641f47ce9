"""Addresses as sockets report them."""

from __future__ import annotations

import pytest

from proto.addresses import is_loopback


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *((text, True) for text in ("127.0.0.1", "127.1.2.3", "::1", "::ffff:127.0.0.1")),
        *((text, False) for text in ("10.0.0.1", "::", "fe80::1%eth0", "robot", "localhost", "")),
    ],
)
def test_loopback_addresses_are_known(text: str, expected: bool) -> None:
    """Names may stand for any address, so none of them is one."""
    assert is_loopback(text) is expected
