"""Attacks of full size on a page; their target is its URL, and its broker's."""

from __future__ import annotations

import gzip
import select
import socket
import ssl
import time
from contextlib import ExitStack, suppress
from typing import Final
from urllib.parse import urlsplit

from broker.access.credentials import hash_token
from tests.certificates import Authority
from tests.hostile.victims import PAGE, TOKEN, Attack, Processes, Started, Victim, page_with

MIB: Final = 2**20
HOST: Final = b" HTTP/1.1\r\nHost: localhost\r\n"
AUTHORIZED: Final = b"Authorization: Bearer %s\r\n" % TOKEN.encode()
USERS: Final = 40
"""Users who sign in beside wrong tokens; more than may be signed in at the same time."""


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


def compressed(page: str, _broker: str) -> None:
    """Case 70: bodies that expand a thousandfold, one after the other."""
    body = gzip.compress(bytes(950 * MIB), 9) if not _BODY else _BODY[0]
    _BODY[:] = [body]
    head = b"POST /api/session" + HOST + b"Content-Encoding: gzip\r\nContent-Length: %d\r\n\r\n" % len(body)
    with connect(page) as sock:
        sock.sendall(head + body)
        while sock.recv(100_000):
            pass


_BODY: Final[list[bytes]] = []
"""The compressed body: it takes seconds to make."""


def half_open(page: str, _broker: str) -> None:
    """Case 71: handshakes of TLS that never end."""
    greeting = ssl.MemoryBIO()
    context = ssl.create_default_context()
    half = context.wrap_bio(ssl.MemoryBIO(), greeting, server_hostname="localhost")
    with suppress(ssl.SSLWantReadError):
        half.do_handshake()
    hello = greeting.read()
    with ExitStack() as stack:
        for _ in range(2000):
            sock = stack.enter_context(connect(page))
            with suppress(OSError):
                sock.sendall(hello)
        time.sleep(60)


def bodies(page: str, _broker: str) -> None:
    """Case 73: bodies of 4 MB without a token that never end."""
    with ExitStack() as stack:
        open_ = [stack.enter_context(connect(page)) for _ in range(200)]
        for number, sock in enumerate(open_):
            sock.setblocking(False)
            first = b"POST /api/session" if number % 2 else b"GET /"
            with suppress(OSError):
                sock.send(first + HOST + b"Content-Length: %d\r\n\r\n" % (4 * MIB))
        chunk, left = bytes(MIB // 16), 60
        while open_ and left:
            _, ready, _ = select.select([], open_, [], 1)
            for sock in ready:
                try:
                    sock.send(chunk)
                except BlockingIOError:
                    pass
                except OSError:
                    open_.remove(sock)
            left -= not ready


def tokens(page: str, _broker: str) -> None:
    """Case 75: wrong tokens on four connections."""
    with ExitStack() as stack:
        open_ = [stack.enter_context(connect(page)) for _ in range(4)]
        for number in range(10_000):
            wrong = b"Authorization: Bearer cbt_%043d\r\n\r\n"
            for each, sock in enumerate(open_):
                sock.sendall(b"GET /api/nodes" + HOST + wrong % (4 * number + each))
            for sock in open_:
                if not sock.recv(100_000):
                    return


def unread(page: str, _broker: str) -> None:
    """Case 76: streams and files of one user that are not read."""
    with ExitStack() as stack:
        for number in range(300):
            sock = stack.enter_context(connect(page))
            sock.setblocking(False)
            path = b"/api/log" if number % 2 else b"/vendor/cytoscape.esm.min.mjs"
            with suppress(OSError):
                sock.send((b"GET " + path + HOST + AUTHORIZED + b"\r\n") * 20)
        time.sleep(60)


def _start_tls_page(processes: Processes, name: str) -> Started:
    pair = Authority(processes.folder, name).issue("127.0.0.1")
    options = ("--tls-cert", str(pair.certificate), "--tls-key", str(pair.key))
    return page_with(name, *options).start(processes, name)


def _start_users_page(processes: Processes, name: str) -> Started:
    """Start a page where users of the broker sign in; some do so all the time."""
    known = [f"cbt_{number:043d}" for number in range(USERS)]
    rules = processes.folder / f"{name}.toml"
    users = (
        f'[users.u{n}]\ntokens = ["{hash_token(each)}"]\nroles = ["all"]\n' for n, each in enumerate(known)
    )
    allowed = ("node", "publish", "subscribe", "serve", "call", "see", "administer")
    role = "[roles.all]\n" + "".join(f'allow.{each} = ["/**"]\n' for each in allowed)
    rules.write_text("".join((*users, role)), encoding="ascii")
    token = processes.folder / f"{name}.token"
    token.touch(mode=0o600)
    token.write_text(TOKEN, encoding="ascii")
    _, url = processes.broker(name, "--auth", str(rules))
    environment = {"CALLBOARD_TOKEN": known[0]}
    pid, page = processes.page(url, "--users", "--token", str(token), env=environment)
    return Started(pid, (page, url), (page, TOKEN, *known))


TLS_PAGE: Final = PAGE._replace(name="page-tls", start=_start_tls_page)
USERS_PAGE: Final = Victim("page-users", _start_users_page, "tests.hostile.visitors")

ATTACKS: Final = {
    "page-compressed": Attack(70, compressed, 50, victim=PAGE),
    "page-half-open": Attack(71, half_open, 50, victim=TLS_PAGE),
    "page-silent": Attack(72, silent, 50, victim=PAGE),
    "page-bodies": Attack(73, bodies, 100, victim=PAGE),
    "page-tokens": Attack(75, tokens, 50, victim=USERS_PAGE),
    "page-unread": Attack(76, unread, 100, victim=PAGE),
}
