"""A bystander of other brokers: `python -m tests.hostile.round_trips URL CA`.

It publishes 500 small messages a second, and receives them on another connection. Like `innocents.py` it
stops when standard input ends, and prints JSON.
"""

from __future__ import annotations

import json
import re
import socket
import ssl
import sys
import threading
import time
from contextlib import suppress
from typing import Final
from urllib.parse import urlsplit

from tests.hostile.peer_attacks import mqtt, publication, subscribe

RATE_HZ: Final = 500
TOPIC: Final = "innocent"
DIGITS: Final = 20
MESSAGE: Final = re.compile(rb"sent:([0-9]{%d})" % DIGITS)


def connect(url: str, ca: str) -> socket.socket:
    """Open a session, with TLS if there is an authority."""
    target = urlsplit(url)
    assert target.hostname is not None
    link = socket.create_connection((target.hostname, target.port or 0), timeout=30)
    link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    nats = url.startswith("nats")
    if nats:
        link.recv(4096)
    if ca:
        link = ssl.create_default_context(cafile=ca).wrap_socket(link, server_hostname=target.hostname)
    if nats:
        link.sendall(b'CONNECT {"verbose":false}\r\n')
    else:
        link.sendall(mqtt(0x10, b"\x00\x04MQTT\x04\x02\x00\x00\x00\x00"))
        link.recv(4)
    return link


def main() -> None:
    """Measure until standard input ends."""
    url, ca = sys.argv[1:]
    reader, writer = connect(url, ca), connect(url, ca)
    samples: list[tuple[float, float]] = []

    def read() -> None:
        rest = b""
        with suppress(OSError):
            while data := reader.recv(65536):
                now, rest = time.monotonic(), rest + data
                for found in MESSAGE.finditer(rest):
                    sent = int(found[1]) / 1e9
                    samples.append((sent, now - sent))
                rest = MESSAGE.sub(b"", rest)[-100:]

    reader.sendall(subscribe(url, TOPIC))
    threading.Thread(target=read, daemon=True).start()
    ended = threading.Event()

    def wait_for_end() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=wait_for_end, daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    time.sleep(0.5)
    began, published, failed = time.monotonic(), 0, 0
    while not ended.wait(max(0.0, began + published / RATE_HZ - time.monotonic())):
        payload = f"sent:{time.monotonic_ns():0{DIGITS}}".encode()
        try:
            writer.sendall(publication(url, TOPIC, payload))
        except OSError:
            failed += 1
        published += 1
    time.sleep(1.0)
    lost = published - len(samples)
    json.dump({"lost": lost, "failed": failed, "samples": {"message": samples}}, sys.stdout)


if __name__ == "__main__":
    main()
