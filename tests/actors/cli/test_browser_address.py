"""What a browser is told to open."""

from __future__ import annotations

import stat
from pathlib import Path
from urllib.parse import urlsplit

from actors.cli.browser_address import browser_address


def test_an_address_without_a_token_is_opened_as_it_is() -> None:
    """Everybody may know it."""
    with browser_address("http://127.0.0.1:7412/") as address:
        assert address == "http://127.0.0.1:7412/"


def test_a_token_is_not_in_the_command_line() -> None:
    """But in a file of this user alone, which leads to the page and is deleted."""
    with browser_address("http://127.0.0.1:7412/#token=secret") as address:
        assert "secret" not in address
        file = Path(urlsplit(address).path)
        assert 'url=http://127.0.0.1:7412/#token=secret"' in file.read_text(encoding="utf-8")
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert not file.exists()
