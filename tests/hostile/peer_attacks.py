"""Attacks of full size that fit any broker: callboard's, nats-server and mosquitto (`--peers`).

Their target is a URL, whose scheme is that of the protocol: `callboard`, `nats`, `mqtt`, and with TLS
`callboards`, `natss` and `mqtts`.
"""

from __future__ import annotations

import socket
import time
from contextlib import ExitStack, closing
from itertools import count
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from tests.broker import frame_makers as make
from tests.certificates import Authority
from tests.hostile.attacks import Link
from tests.hostile.victims import Attack, Processes, Started, Victim, free_port, listens, wait_until

if TYPE_CHECKING:
    from collections.abc import Callable

CONNECTIONS: Final = 2000
READERS: Final = 100
TOPIC: Final = "/flood"
MESSAGE: Final = bytes(100_000)


def connect(url: str) -> socket.socket:
    """Connect without a word."""
    target = urlsplit(url)
    assert target.hostname is not None
    return socket.create_connection((target.hostname, target.port or 0))


def silent(url: str) -> None:
    """Case 8: connections that say nothing."""
    with ExitStack() as stack:
        for _ in range(CONNECTIONS):
            stack.enter_context(connect(url))
        time.sleep(60)


def half_open_tls(url: str) -> None:
    """Case 8: connections that begin with the header of a TLS record."""
    with ExitStack() as stack:
        for _ in range(CONNECTIONS):
            link = stack.enter_context(connect(url))
            if url.startswith("nats"):
                link.recv(4096)  # INFO, after which TLS begins
            link.sendall(b"\x16\x03\x01\x02\x00")
        time.sleep(60)


def short(url: str) -> None:
    """Case 32: connections that end at once."""
    while True:
        connect(url).close()


def open_session(url: str) -> socket.socket:
    """Connect to a peer, and send what it needs first."""
    link = connect(url)
    if url.startswith("nats"):
        link.recv(4096)
        link.sendall(b'CONNECT {"verbose":false}\r\n')
    else:
        link.sendall(mqtt(0x10, b"\x00\x04MQTT\x04\x02\x00\x00\x00\x00"))
        link.recv(4)
    return link


def mqtt(kind: int, content: bytes, size: int | None = None) -> bytes:
    """Return a packet of MQTT, whose size may be a lie."""
    left, length = len(content) if size is None else size, bytearray()
    while not length or left:
        left, seven = divmod(left, 128)
        length.append(seven | (128 if left else 0))
    return bytes([kind]) + bytes(length) + content


def subscribe(url: str, topic: str) -> bytes:
    """Return what subscribes to a topic of a peer."""
    if url.startswith("nats"):
        return f"SUB {topic} 1\r\n".encode()
    name = topic.encode()
    return mqtt(0x82, b"\x00\x01" + len(name).to_bytes(2, "big") + name + b"\x00")


def publication(url: str, topic: str, payload: bytes) -> bytes:
    """Return a message for a peer."""
    if url.startswith("nats"):
        return f"PUB {topic} {len(payload)}\r\n".encode() + payload + b"\r\n"
    name = topic.encode()
    return mqtt(0x30, len(name).to_bytes(2, "big") + name + payload)


def deaf_readers(url: str) -> None:
    """Case 29: subscribers that do not read, and a flood for them."""
    with ExitStack() as stack:
        if not url.startswith("callboard"):
            for _ in range(READERS):
                stack.enter_context(open_session(url)).sendall(subscribe(url, TOPIC))
            sender = stack.enter_context(open_session(url))
            message = publication(url, TOPIC, MESSAGE)
            while True:
                sender.sendall(message)
        for _ in range(READERS):
            stack.enter_context(closing(Link(url))).send(make.subscription(1, TOPIC, raw=True))
        link = stack.enter_context(closing(Link(url)))
        number = link.publisher(make.publisher(1, TOPIC))
        for first in count():
            link.send(make.batch(number, first, size=len(MESSAGE)))


def claims(url: str) -> None:
    """Case 3: announcements of the largest messages, and nothing behind them."""
    with ExitStack() as stack:
        for _ in range(READERS):
            if url.startswith("callboard"):
                stack.enter_context(closing(Link(url))).send_bytes(b"\xc6\xff\xff\xff\xff")
            elif url.startswith("nats"):
                stack.enter_context(open_session(url)).sendall(b"PUB x 1048576\r\n")
            else:
                stack.enter_context(open_session(url)).sendall(mqtt(0x30, b"", 2**28 - 1))
        time.sleep(60)


def _start_nats(processes: Processes, name: str, *, tls: bool = False) -> Started:
    port = free_port()
    command, ca = ["nats-server", "-a", "127.0.0.1", "-p", str(port), "-l", "/dev/null"], ""
    if tls:
        authority = Authority(processes.folder, name)
        pair, ca = authority.issue("127.0.0.1"), str(authority.ca)
        command += ["--tls", "--tlscert", str(pair.certificate), "--tlskey", str(pair.key)]
    return _start_peer(processes, command, f"nats{'s' * tls}://127.0.0.1:{port}", ca)


def _start_mosquitto(processes: Processes, name: str, *, tls: bool = False) -> Started:
    port, ca = free_port(), ""
    lines = [f"listener {port} 127.0.0.1", "allow_anonymous true", "log_dest none", "user root"]
    if tls:
        authority = Authority(processes.folder, name)
        pair, ca = authority.issue("127.0.0.1"), str(authority.ca)
        lines += [f"certfile {pair.certificate}", f"keyfile {pair.key}"]
    file = processes.folder / f"{name}.conf"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return _start_peer(processes, ["mosquitto", "-c", str(file)], f"mqtt{'s' * tls}://127.0.0.1:{port}", ca)


def _start_peer(processes: Processes, command: list[str], url: str, ca: str) -> Started:
    pid: int = processes.program(*command).pid
    wait_until(command[0], lambda: listens(urlsplit(url).port or 0))
    return Started(pid, (url,), (url, ca))


def _start_tls_broker(processes: Processes, name: str) -> Started:
    authority = Authority(processes.folder, name)
    pair = authority.issue("127.0.0.1", "localhost")
    pid, url = processes.broker(name, "--tls-cert", str(pair.certificate), "--tls-key", str(pair.key))
    return Started(pid, (url,), (url,), {"CALLBOARD_CA": str(authority.ca)})


def _peers(*, tls: bool = False) -> tuple[Victim, ...]:
    def start(kind: Callable[..., Started]) -> Callable[[Processes, str], Started]:
        return lambda processes, name: kind(processes, name, tls=tls)

    bystander = "tests.hostile.round_trips"
    return (
        Victim("nats", start(_start_nats), bystander),
        Victim("mosquitto", start(_start_mosquitto), bystander),
    )


TLS_BROKER: Final = Victim("broker", _start_tls_broker)

ATTACKS: Final = {
    "claims": Attack(3, claims, peers=_peers()),
    "silent": Attack(8, silent, peers=_peers()),
    "half-open-tls": Attack(8, half_open_tls, victim=TLS_BROKER, peers=_peers(tls=True)),
    "deaf-readers": Attack(29, deaf_readers, peers=_peers()),
    "short": Attack(32, short, peers=_peers()),
}
