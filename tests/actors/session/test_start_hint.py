"""The command that would start a broker at a place."""

from __future__ import annotations

import pytest

from actors.session.start_hint import start_hint
from proto.url import parse_url


@pytest.mark.parametrize(
    ("url", "hint"),
    [
        ("callboard://127.0.0.1:7411", "Start one with: callboard broker"),
        ("callboard://[::1]:9", "Start one with: callboard broker --port 9"),
        ("callboard://robot", "Start one there with: callboard broker --host robot"),
        ("callboard+unix:///tmp/x", "Start one with: callboard broker --unix /tmp/x"),
    ],
)
def test_the_hint_is_a_command_for_that_place(url: str, hint: str) -> None:
    """Port, host and path are the URL's."""
    assert start_hint(parse_url(url)) == hint
