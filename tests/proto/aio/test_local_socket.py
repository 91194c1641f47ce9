"""Who is reached by the unix socket beside a port, and who is not."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING

import pytest

from proto.aio import local_socket
from proto.aio.local_socket import address_in, connect_beside, listen_beside, local_name
from tests.system import forbid_sockets

if TYPE_CHECKING:
    import socket

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has abstract names")

PORT = 7411


def listening(address: str = "127.0.0.1", backlog: int = 8) -> closing[socket.socket]:
    """Listen beside the port; the name is free, since each test runs as a made-up user."""
    sock = listen_beside(address, PORT, backlog)
    assert sock is not None
    return closing(sock)


@pytest.fixture(autouse=True)
def user(monkeypatch: pytest.MonkeyPatch) -> int:
    """The user whose sockets a test makes: a number that no other test or process has."""
    number = 1_000_000 + os.getpid()
    monkeypatch.setattr("os.geteuid", lambda: number)
    monkeypatch.setattr(local_socket, "peer_user", lambda _: number)
    return number


@pytest.mark.parametrize(
    ("bound", "host"),
    [("127.0.0.1", "127.0.0.1"), ("127.0.0.1", "localhost"), ("0.0.0.0", "127.0.0.1"), ("::", "::1")],
)
def test_a_port_of_the_loopback_device_is_reached(bound: str, host: str) -> None:
    """The connection goes to the one who listens, and its name tells which address was meant."""
    with listening(bound) as server:
        found = connect_beside(host, PORT)
        assert found is not None
        with found, server.accept()[0] as accepted:
            found.sendall(b"hello")
            assert accepted.recv(5) == b"hello"
            assert address_in(accepted.getsockname()) == local_socket.HOSTS[host]


@pytest.mark.parametrize("host", ["::1", "127.0.0.2", "192.0.2.1", "robot"])
def test_another_host_is_not_reached(host: str) -> None:
    """Each address has a name of its own; those of other machines, and unusual ones, have none."""
    with listening():
        assert connect_beside(host, PORT) is None
        assert connect_beside("127.0.0.1", PORT + 1) is None


def test_nothing_listens_beside_a_port_that_other_machines_reach() -> None:
    """Clients there would not look for it."""
    assert listen_beside("192.0.2.1", PORT, 8) is None
    assert listen_beside("127.0.0.2", PORT, 8) is None


def test_a_listener_of_another_user_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Anybody can take the name."""
    with listening():
        monkeypatch.setattr(local_socket, "peer_user", lambda _: 7)
        assert connect_beside("127.0.0.1", PORT) is None


def test_a_listener_with_too_many_waiting_is_not_waited_for() -> None:
    """With TCP the caller waits for it."""
    with listening(backlog=0), ExitStack() as stack:
        while (waiting := connect_beside("127.0.0.1", PORT)) is not None:
            stack.enter_context(waiting)


def test_where_unix_sockets_are_forbidden_nobody_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a service manager or a sandbox: then the caller uses TCP."""
    with listening():
        forbid_sockets(monkeypatch)
        assert connect_beside("127.0.0.1", PORT) is None


def test_a_name_is_taken_once() -> None:
    """The second one is told, and its socket is closed."""
    with listening():
        with pytest.raises(OSError, match="in use") as caught:
            listen_beside("127.0.0.1", PORT, 8)
        assert caught.value.errno == errno.EADDRINUSE
    with listening():
        pass


@pytest.mark.parametrize("name", ["", "/run/callboard.sock", b"", b"\0other", ("127.0.0.1", 7411)])
def test_other_names_have_no_address(name: object) -> None:
    """Those of socket files, of unnamed sockets, and of TCP."""
    assert address_in(name) is None


def test_the_name_is_of_one_user(user: int) -> None:
    """Brokers of several users do not meet."""
    assert local_name("127.0.0.1", PORT) == b"\0callboard-%d-127.0.0.1:7411" % user
