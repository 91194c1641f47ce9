"""The command that would start a broker at a place."""

from __future__ import annotations

import socket

import pytest

from actors.session.start_hint import start_hint
from proto.wire.url import parse_url


@pytest.mark.parametrize(
    ("url", "hint"),
    [
        ("callboard://127.0.0.1:7411", "Start one with: callboard broker"),
        ("callboard://[::1]:9", "Start one with: callboard broker --port 9"),
        ("callboard://robot", "Start one there with: callboard broker --host robot --auth FILE"),
        ("callboard+unix:///tmp/x", "Start one with: callboard broker --unix /tmp/x"),
    ],
)
def test_the_hint_is_a_command_for_that_place(url: str, hint: str) -> None:
    """Port, host and path are the URL's."""
    assert start_hint(parse_url(url)) == hint


def test_a_host_without_an_address_is_named() -> None:
    """No command would help there."""
    error = socket.gaierror(socket.EAI_NONAME, "Name or service not known")
    hint = start_hint(parse_url("callboard://nosuch.invalid:7411"), error)
    assert hint == "The host name 'nosuch.invalid' cannot be resolved"
