"""Addresses as sockets report them."""

from __future__ import annotations

import pytest

from proto.wire.addresses import is_address, is_loopback


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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *((text, True) for text in ("127.0.0.1", "10.0.0.1", "::", "fe80::1%eth0")),
        *((text, False) for text in ("robot", "localhost", "10.0.0.1.nip.io", "")),
    ],
)
def test_addresses_differ_from_names(text: str, expected: bool) -> None:
    """Whatever a name may resolve to."""
    assert is_address(text) is expected
