"""Attacks of full size on a broker; their target is its URL."""

from __future__ import annotations

import os
import socket
import sys
import threading
from contextlib import closing, suppress
from itertools import count
from typing import TYPE_CHECKING, Final, TypeVar

from proto import limits
from proto.aio.arena import read_token
from proto.aio.session_proof import connection_ends, session_proof
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.url import parse_url
from tests.broker import frame_makers as make
from tests.hostile.innocents import TOPIC
from tests.hostile.victims import Attack

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F")
MIB: Final = 2**20
LARGE: Final = bytes(200_000)


class Link:
    """A blocking connection with a node; what it does not wait for it does not read.

    Args:
        url: The broker's.
        host: Its host identity, to share memory with it.
    """

    def __init__(self, url: str, host: bytes | None = None) -> None:
        target = parse_url(url)
        self._socket = socket.create_connection((target.host, target.port))
        self._file = self._socket.makefile("rb")
        identity: frames.Options = {"instance": os.urandom(16), "token": os.urandom(16)}
        if host is not None:
            identity = {**identity, "host": host}
        self.send(frames.Hello(limits.PROTOCOL_VERSION, identity))
        welcome = self.wait(frames.Welcome)
        if host is not None:
            names = "secret_process", "secret_descriptor", "session"
            process, descriptor, session = (int(str(welcome.options[name])) for name in names)
            ends = {"sockname": self._socket.getsockname(), "peername": self._socket.getpeername()}
            secret = read_token(process, descriptor)
            self.send(frames.Proof(session_proof(secret, session, connection_ends(ends.get, client=True))))
        self.send(frames.Node(0, f"/attacker_{os.urandom(4).hex()}"))

    def send(self, *sent: frames.Frame) -> None:
        """Send frames."""
        self.send_bytes(b"".join(encode(frame) for frame in sent))

    def send_bytes(self, data: bytes) -> None:
        """Send anything."""
        self._socket.sendall(data)

    def wait(self, kind: type[F]) -> F:
        """Read until a frame of a kind comes; a broker that closes raises EOFError."""
        while True:
            head = self._file.read(limits.PREFIX_BYTES)
            if len(head) < limits.PREFIX_BYTES:
                raise EOFError
            frame = decode(head + self._file.read(int.from_bytes(head[1:], "big")))
            if isinstance(frame, kind):
                return frame

    def publisher(self, declaration: frames.Publisher) -> int:
        """Declare a publisher; return its number."""
        self.send(declaration)
        while (accepted := self.wait(frames.Accepted)).id != declaration.id:
            pass
        return accepted.number

    def flood(self, *sent: frames.Frame, times: int = sys.maxsize, answers: bool = True) -> None:
        """Send the same frames again and again, and read the answers at the same time."""
        if answers:
            threading.Thread(target=self.drain, daemon=True).start()
        one = b"".join(encode(frame) for frame in sent)
        chunk = max(1, 100_000 // len(one))
        for _ in range(0, times, chunk):
            self.send_bytes(one * chunk)

    def drain(self) -> None:
        """Read until the connection ends."""
        with suppress(OSError, ValueError):
            while self._file.read1(MIB):
                pass

    def close(self) -> None:
        """End the connection."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


def matching(url: str) -> None:
    """Case 43: 2,000 raw subscriptions, then 2,000 publishers, on one topic."""
    with closing(Link(url)) as link:
        threading.Thread(target=link.drain, daemon=True).start()
        link.send(*(make.subscription(n, raw=True) for n in range(1, 2001)))
        link.send(*(make.publisher(n) for n in range(2001, 4001)))
        link.flood(frames.Ping(1), times=100_000, answers=False)


def no_credit(url: str) -> None:
    """Case 44: a KEEP_ALL subscription to the innocents' topic that grants no credit."""
    with closing(Link(url)) as link:
        link.send(make.subscription(1, TOPIC, raw=True, qos=make.KEEP_ALL, window=1))
        link.drain()


def copied_gid(url: str) -> None:
    """Case 45: a publisher on the innocents' topic with their gid and a huge sequence number."""
    with closing(Link(url)) as spy:
        spy.send(make.subscription(1, TOPIC, raw=True))
        attached = spy.wait(frames.Attached)
        spy.send(frames.Watch(1, keep=False))
        entries = (entry for _ in count() for entry in spy.wait(frames.Graph).added)
        innocent = next(entry for entry in entries if entry.name == TOPIC)
    with closing(Link(url)) as link:
        declaration = make.publisher(1, TOPIC, type_hash=innocent.type_hash, next_sequence=2**62)
        number = link.publisher(declaration._replace(type_name=innocent.type_name, gid=attached.gid))
        link.send(make.batch(number, 2**62))
        link.drain()


def attributes(url: str) -> None:
    """Case 46: tiny messages with large attributes for a reader that does not read, and latched ones."""
    with closing(Link(url)) as deaf, closing(Link(url)) as link:
        deaf.send(make.subscription(1, "/big", qos={"depth": limits.MAX_DEPTH}))
        deaf.send(*(frames.Ping(n) for n in range(10_000)))
        number = link.publisher(make.publisher(1, "/big", qos={**make.LATCHED, "depth": limits.MAX_DEPTH}))
        threading.Thread(target=link.drain, daemon=True).start()
        text = {"x": bytes(limits.MAX_ATTRIBUTES_BYTES - 100)}
        for first in count():
            batch = make.batch(number, first)._replace(attributes=text if first % 2 else None)
            link.send(batch._replace(raw=b""))


def fragments(url: str) -> None:
    """Case 47: messages that are never finished, on three links."""
    with closing(Link(url)) as one, closing(Link(url)) as two, closing(Link(url)) as three:
        for link in (one, two, three):
            with suppress(OSError):
                for transfer in range(limits.MAX_TRANSFERS):
                    link.send(frames.Fragment(transfer, 60 * MIB, more=True, payload=LARGE))
                for _ in range(250):
                    for transfer in range(limits.MAX_TRANSFERS):
                        link.send(frames.Fragment(transfer, None, more=True, payload=LARGE))


def sessions(url: str) -> None:
    """Case 48: large sessions that end, one after the other."""
    with closing(Link(url)) as deaf, closing(Link(url)) as link:
        deaf.send(make.subscription(1, "/large", qos={"depth": 10_000}))
        number = link.publisher(make.publisher(1, "/large"))
        for first in range(1200):
            link.send(make.batch(number, first, size=len(LARGE)))


def departed(url: str) -> None:
    """Case 49: publishers that come, publish one message, and go, for a reader that does not read."""
    with closing(Link(url)) as deaf, closing(Link(url)) as link:
        deaf.send(make.subscription(1, "/gone"))
        for _ in range(100_000):
            number = link.publisher(make.publisher(1, "/gone")._replace(gid=os.urandom(16)))
            link.send(make.batch(number, 0), frames.Undeclare(1))


def nested(url: str) -> None:
    """Case 50: small frames that announce nested arrays."""
    content = b"\x93\x28\x01" + b"\xdc\x20\x00" * 1000
    with closing(Link(url)) as link:
        link.send_bytes(b"\xc6" + len(content).to_bytes(4, "big") + content)
        link.drain()


def calls(url: str) -> None:
    """Case 52: calls of 100 KB for a server that does not read."""
    with closing(Link(url)) as server, closing(Link(url)) as link:
        server.send(make.service(1, "/slow"))
        link.send(make.client(1, "/slow"))
        threading.Thread(target=link.drain, daemon=True).start()
        for number in count():
            link.send(make.request(1, number, body=LARGE[:100_000]))


def latched(url: str) -> None:
    """Case 53: six latched messages of 60 MiB, and readers that come for them."""
    with closing(Link(url)) as link:
        number = link.publisher(make.publisher(1, "/map", qos={**make.LATCHED, "depth": 6}))
        threading.Thread(target=link.drain, daemon=True).start()
        for transfer in range(6):
            raw = make.batch(number, transfer, size=60 * MIB).raw
            view, size = memoryview(raw), len(LARGE)
            for start in range(0, len(raw), size):
                total, more = (len(raw) if start == 0 else None), start + size < len(raw)
                link.send(frames.Fragment(transfer, total, more, view[start : start + size]))
        while True:
            with closing(Link(url)) as reader:
                reader.send(make.subscription(1, "/map", qos={**make.LATCHED, "depth": 6}))
                for _ in range(1000):
                    reader.wait(frames.Fragment)


def _flood(*sent: frames.Frame, before: tuple[frames.Frame, ...] = ()) -> Callable[[str], None]:
    def attack(url: str) -> None:
        with closing(Link(url)) as link:
            link.send(*before)
            link.flood(*sent)

    return attack


def entries(url: str) -> None:
    """Case 54: graph queries with 5,000 endpoints in the graph."""
    with closing(Link(url)) as link:
        link.send(*(make.subscription(n, f"/entry{n}", raw=True) for n in range(1, 5001)))
        link.flood(frames.Watch(1, keep=False))


def error_texts(url: str) -> None:
    """Case 56: ERROR frames of control characters, on one connection after the other."""
    with closing(Link(url)) as link:
        link.send(frames.Error(1, "\x1b[2J\n" * 400))
        link.drain()


DECLARATIONS: Final = (make.subscription(1, "/churn", raw=True), frames.Undeclare(1))
WRONG_TYPES: Final = (make.subscription(1, TOPIC), frames.Undeclare(1))

ATTACKS: Final = {
    "matching": Attack(43, matching),
    "no-credit": Attack(44, no_credit),
    "copied-gid": Attack(45, copied_gid),
    "attributes": Attack(46, attributes, 1000),
    "fragments": Attack(47, fragments, 600),
    "sessions": Attack(48, sessions, 800),
    "departed": Attack(49, departed),
    "nested": Attack(50, nested),
    "calls": Attack(52, calls),
    "latched": Attack(53, latched, 1000),
    "ping": Attack(54, _flood(frames.Ping(1))),
    "declarations": Attack(54, _flood(*DECLARATIONS)),
    "inspect": Attack(54, _flood(frames.Inspect(1))),
    "describe": Attack(54, _flood(frames.Describe(make.HASH))),
    "watch": Attack(54, entries),
    "error-texts": Attack(56, error_texts),
    "wrong-types": Attack(56, _flood(*WRONG_TYPES)),
}
"""By name. 51 is a matter of the decoder alone, and 55 of nodes: they are not floods."""
