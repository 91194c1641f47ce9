"""The proof of a session is bound to its connection, which both ends describe in the same words."""

from __future__ import annotations

from typing import Any

import pytest

from proto.aio.session_proof import connection_ends, session_proof

CLIENT, BROKER = ("127.0.0.1", 40000), ("127.0.0.1", 7411)


def seen(own: Any, peer: Any, *, client: bool) -> bytes:
    """Return what an end whose socket has these names says."""
    return connection_ends({"sockname": own, "peername": peer}.get, client=client)


@pytest.mark.parametrize(
    ("client", "broker"),
    [
        ((CLIENT, BROKER), (BROKER, CLIENT)),
        ((CLIENT, BROKER), (("::ffff:127.0.0.1", 7411, 0, 0), ("::ffff:127.0.0.1", 40000, 0, 0))),
        ((("::1", 40000, 0, 0), ("::1", 7411, 0, 0)), (("::1", 7411, 0, 0), ("::1", 40000, 0, 0))),
        (("", "/run/broker"), ("/run/broker", "")),
    ],
    ids=["IPv4", "IPv4 at an IPv6 socket", "IPv6", "unix"],
)
def test_both_ends_say_the_same(client: tuple[Any, Any], broker: tuple[Any, Any]) -> None:
    """Whatever the family of their sockets."""
    assert seen(*client, client=True) == seen(*broker, client=False)


def test_the_words_are_those_of_the_protocol() -> None:
    """The client first; nothing for a unix socket."""
    assert seen(CLIENT, BROKER, client=True) == b"127.0.0.1 40000 127.0.0.1 7411"
    assert seen("", "/run/broker", client=True) == b""


@pytest.mark.parametrize(
    ("own", "peer"),
    [
        (("127.0.0.2", 40000), BROKER),
        (("127.0.0.1", 40001), BROKER),
        (CLIENT, ("127.0.0.2", 7411)),
        (CLIENT, ("127.0.0.1", 7412)),
        (BROKER, CLIENT),
    ],
)
def test_another_connection_needs_another_proof(own: tuple[str, int], peer: tuple[str, int]) -> None:
    """Another address or port at either end, or the other direction."""
    secret = bytes(range(16))
    proof = session_proof(secret, 7, seen(CLIENT, BROKER, client=True))
    assert proof != session_proof(secret, 7, seen(own, peer, client=True))
    assert proof != session_proof(secret, 8, seen(CLIENT, BROKER, client=True))
