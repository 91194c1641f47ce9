"""Attacks of full size on a page by one of its users: requests that are much work."""

from __future__ import annotations

import json
import threading
from contextlib import closing
from itertools import count
from typing import TYPE_CHECKING, Final

from actors.interfaces.message import definition, type_hash, type_name
from actors.interfaces.runtime_types import runtime_message
from proto.wire import frames
from tests.hostile.attacks import Link
from tests.hostile.victims import PAGE, TOKEN, Attack
from tests.hostile.web_attacks import connect

if TYPE_CHECKING:
    import socket

TOPICS: Final = 3000
CLIENTS: Final = 4
HEAD: Final = b" HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer %s\r\n\r\n" % TOKEN.encode()
END: Final = b"\r\n\r\n"


def publisher(number: int, topic: str, digest: str = "", described: bytes | None = None) -> frames.Publisher:
    """Return the declaration of a publisher with a gid of its own."""
    name = "wide/msg/Wide" if described else "std_msgs/msg/String"
    gid = number.to_bytes(16, "big")
    return frames.Publisher(number, 0, topic, name, digest, {}, gid, 0, described)


def get(sock: socket.socket, path: str) -> None:
    """Ask once, and read the whole answer."""
    sock.sendall(b"GET " + path.encode() + HEAD)
    received = b""
    while END not in received:
        received += receive(sock)
    head, _, body = received.partition(END)
    (length,) = (line for line in head.lower().split(b"\r\n") if line.startswith(b"content-length:"))
    left = int(length.split(b":")[1]) - len(body)
    while left > 0:
        left -= len(receive(sock))


def receive(sock: socket.socket) -> bytes:
    """Return some bytes; raises EOFError at the end."""
    if not (received := sock.recv(200_000)):
        raise EOFError
    return received


def ask(page: str, *paths: str) -> None:
    """Ask for these again and again, on some connections at the same time."""

    def client() -> None:
        with connect(page) as sock:
            for number in count():
                get(sock, paths[number % len(paths)])

    threads = [threading.Thread(target=client, daemon=True) for _ in range(CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def documents(page: str, broker: str) -> None:
    """Case 77: documents of a graph of 3,000 topics, whole and by name."""
    with closing(Link(broker)) as link:
        threading.Thread(target=link.drain, daemon=True).start()
        link.send(*(publisher(number, f"/wide/t{number}") for number in range(1, TOPICS + 1)))
        ask(page, "/api/graph", "/api/overview", "/api/topics/wide/t7", "/api/nodes", "/api/services")


def forms(page: str, broker: str) -> None:
    """Case 78: the form of a type of 500,000 elements."""
    kind = {"type_id": 6 + 48, "capacity": 500_000, "string_capacity": 0, "nested_type_name": ""}
    field = {"name": "x", "type": kind}
    top = {"type_name": "wide/msg/Wide", "fields": [field]}
    made = runtime_message(json.dumps({"type_description": top, "referenced_type_descriptions": []}).encode())
    assert type_name(made) == "wide/msg/Wide"
    with closing(Link(broker)) as link:
        threading.Thread(target=link.drain, daemon=True).start()
        link.send(publisher(1, "/wide", type_hash(made), definition(made)))
        ask(page, "/api/topics/wide/form")


def labels(page: str, broker: str) -> None:
    """Case 79: a hundred new topics before each scrape."""
    with closing(Link(broker)) as link, connect(page) as sock:
        threading.Thread(target=link.drain, daemon=True).start()
        for scrape in count():
            numbers = range(100 * scrape + 1, 100 * scrape + 101)
            link.send(*(publisher(number, f"/new/t{number}") for number in numbers))
            get(sock, "/metrics")
            link.send(*(frames.Undeclare(number) for number in numbers))


ATTACKS: Final = {
    "page-documents": Attack(77, documents, 100, victim=PAGE),
    "page-forms": Attack(78, forms, 100, victim=PAGE),
    "page-labels": Attack(79, labels, 100, victim=PAGE),
}
