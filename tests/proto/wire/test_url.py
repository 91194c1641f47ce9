"""Broker URLs: what is read, what is refused, and that the text says why."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.errors import InvalidUrlError
from proto.wire.url import DEFAULT_PORT, DEFAULT_URL, BrokerUrl, parse_url, parse_urls

GOOD = {
    "callboard://127.0.0.1:7411": BrokerUrl("127.0.0.1", 7411),
    "callboard://broker.example": BrokerUrl("broker.example", DEFAULT_PORT),
    "callboard://broker.example/": BrokerUrl("broker.example", DEFAULT_PORT),
    "callboard://[::1]:99": BrokerUrl("::1", 99),
    "callboards://broker.example": BrokerUrl("broker.example", DEFAULT_PORT, tls=True),
    "callboards://[::1]:99": BrokerUrl("::1", 99, tls=True),
    "callboard+unix:///run/callboard.sock": BrokerUrl("", 0, "/run/callboard.sock"),
}


@pytest.mark.parametrize(("text", "url"), GOOD.items())
def test_urls_that_are_read(text: str, url: BrokerUrl) -> None:
    """§2: host, port and path are found, and the port has a default."""
    assert parse_url(text) == url
    assert parse_url(str(url)) == url


def test_the_default_url_is_the_default() -> None:
    """§2: the default URL names the default host and port."""
    assert str(parse_url(DEFAULT_URL)) == DEFAULT_URL


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "scheme"),
        ("127.0.0.1:7411", "scheme"),
        ("http://x", "scheme"),
        ("callboard://", "host"),
        ("callboard://:7411", "host"),
        ("callboard://x:0", "port 0"),
        ("callboard://x:65536", "ange"),
        ("callboard://x:port", "ort"),
        ("callboard://x:-1", "ort"),
        ("callboard://[::1", "Invalid"),
        ("callboard://x/topic", "path"),
        ("callboard://x?a=1", "only a host"),
        ("callboard://x#a", "only a host"),
        ("callboard://user@x", "only a host"),
        ("callboard+unix://host/path", "path"),
        ("callboard+unix://", "path"),
        ("callboard+unix:///", "path"),
    ],
)
def test_urls_that_are_refused(text: str, reason: str) -> None:
    """§2: what is not a broker URL raises InvalidUrlError and says why."""
    with pytest.raises(InvalidUrlError, match=reason):
        parse_url(text)


@given(st.text(max_size=30), st.sampled_from(["", "callboard://", "callboard+unix://", "callboard://["]))
def test_any_text_is_read_or_refused(text: str, scheme: str) -> None:
    """Any text gives a URL or InvalidUrlError, and nothing else."""
    try:
        url = parse_url(scheme + text)
    except InvalidUrlError:
        return
    assert bool(url.path) != bool(url.host)


def test_lists_keep_their_order() -> None:
    """§2: a list is tried in the order in which it is written."""
    assert parse_urls(" callboard://a , callboard://b,,") == (BrokerUrl("a", 7411), BrokerUrl("b", 7411))
    for text in ("", " , "):
        with pytest.raises(InvalidUrlError, match="No broker URL"):
            parse_urls(text)


def test_secrets_are_not_in_the_error_text() -> None:
    """Hostile case 33: a password in a URL is not repeated."""
    with pytest.raises(InvalidUrlError) as caught:
        parse_url("callboard://user:hunter2@host")
    assert "hunter2" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "local"),
    [
        ("callboard+unix:///run/callboard.sock", True),
        ("callboard://localhost", True),
        ("callboard://127.0.0.2", True),
        ("callboards://[::1]", True),
        ("callboard://192.0.2.1", False),
        ("callboard://broker", False),
    ],
)
def test_only_some_urls_are_on_this_machine_for_certain(text: str, *, local: bool) -> None:
    """A name may be any machine's."""
    assert parse_url(text).is_local is local
