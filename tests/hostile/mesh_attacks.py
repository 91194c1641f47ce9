"""Attacks of full size on a broker of a mesh; their target is its Zenoh endpoint, and its URL."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from __future__ import annotations

import json
import secrets
import struct
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from itertools import count
from typing import TYPE_CHECKING, Final

import msgspec
import zenoh

from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.mesh_keys import broker_id, zenoh_id
from tests.broker import frame_makers as make
from tests.hostile.victims import MESH, Attack

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


PREFIX: Final = "callboard/1/0"
LARGE: Final = 400 * 2**20


@contextmanager
def zenoh_client(endpoint: str, number: int = 0) -> Iterator[zenoh.Session]:
    """Open a session of a client, which finds nobody but the broker; its id is a number, if one is given."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    if number:
        config.insert_json5("id", f'"{zenoh_id(number)}"')
    session = zenoh.open(config)
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]


def _announce(session: zenoh.Session, *numbers: int) -> list[zenoh.LivelinessToken]:
    tokens = session.liveliness()
    return [tokens.declare_token(f"{PREFIX}/alive/{broker_id(number)}") for number in numbers]


def _number() -> int:
    return 2**31 + secrets.randbelow(2**31)


def never_answering(endpoint: str, _url: str) -> None:
    """Case 64: forty brokers that send all that may wait for their snapshots, and never answer."""
    with zenoh_client(endpoint) as session:
        session.declare_queryable(f"{PREFIX}/brokers/*/graph", lambda _: None)
        numbers = [_number() for _ in range(40)]
        tokens = _announce(session, *numbers)
        (here,) = _brokers(session)[:1] or [1]
        frame = encode(make.request(4, 1, body=bytes(200_000)))
        for count in range(1, 1000):
            for number in numbers:
                key = f"{PREFIX}/brokers/{broker_id(here)}/frames/{broker_id(number)}"
                session.put(key, frame, attachment=struct.pack(">QQQ", 1, count, 1))
        del tokens


def many_graphs(endpoint: str, _url: str) -> None:
    """Case 64: such brokers in fifty graphs."""
    frame = encode(make.request(4, 1, body=bytes(200_000)))
    with zenoh_client(endpoint) as session:
        session.declare_queryable("callboard/1/*/brokers/*/graph", lambda _: None)
        graphs, name = range(50), broker_id(_number())
        alive = session.liveliness()
        tokens = [alive.declare_token(f"callboard/1/{graph}/alive/{name}") for graph in graphs]
        (here,) = _brokers(session)[:1] or [1]
        for number in range(1, 1000):
            for graph in graphs:
                key = f"callboard/1/{graph}/brokers/{broker_id(here)}/frames/{name}"
                session.put(key, frame, attachment=struct.pack(">QQQ", 1, number, 1))
        del tokens


def _brokers(session: zenoh.Session) -> list[int]:
    """Return the numbers of the brokers that have answered a query, the attacked one first: it is nearest."""
    replies = session.get(f"{PREFIX}/brokers/*/graph", timeout=1.0)
    return [int(str(reply.ok.key_expr).split("/")[4], 16) for reply in replies if reply.ok is not None]


def tokens(endpoint: str, _url: str) -> None:
    """Case 65: a thousand tokens, again and again."""
    with zenoh_client(endpoint) as session:
        while True:
            declared = _announce(session, *(_number() for _ in range(1000)))
            time.sleep(2.0)
            for token in declared:
                token.undeclare()  # type: ignore[no-untyped-call]


def _serve(session: zenoh.Session, number: int, declarations: Callable[[], list[bytes]]) -> None:
    """Answer as a broker: each time with a greater version, which a heartbeat announces."""
    version = count(1)

    def answer(query: zenoh.Query) -> None:
        if query.payload is None:  # its own query for the numbers
            return
        _, epoch = struct.unpack(">QQ", query.payload.to_bytes())
        snapshot = {"epoch": epoch, "version": next(version), "declarations": declarations()}
        query.reply(query.key_expr, msgspec.msgpack.encode(snapshot))

    mine = f"{PREFIX}/brokers/{broker_id(number)}"
    kept = session.declare_queryable(f"{mine}/graph", answer), _announce(session, number)
    while kept:
        for other in _brokers(session):  # let them import at once
            key = f"{PREFIX}/brokers/{broker_id(other)}/graph"
            list(session.get(key, payload=struct.pack(">QQ", number, 1), timeout=1.0))
        session.put(f"{mine}/heartbeat", msgspec.msgpack.encode((2**40, {}, {})))
        time.sleep(1.0)


def large_snapshot(endpoint: str, _url: str) -> None:
    """Case 66: a broker with 100,000 endpoints, which goes and comes again."""
    declarations = [encode(frames.Node(1, "/many"))]
    declarations += [encode(make.publisher(n, f"/many/n{n}", node=1)) for n in range(2, 100_001)]
    number = _number()
    with zenoh_client(endpoint, number) as session:
        _serve(session, number, lambda: declarations)


def changing_snapshots(endpoint: str, _url: str) -> None:
    """Case 66: 20,000 endpoints, others with each heartbeat."""
    first, number = count(2, 20_000), _number()

    def declarations() -> list[bytes]:
        start = next(first)
        publishers = (make.publisher(n, f"/many/n{n}", node=1) for n in range(start, start + 20_000))
        return [encode(frames.Node(1, "/many")), *map(encode, publishers)]

    with zenoh_client(endpoint, number) as session:
        _serve(session, number, declarations)


def large_snapshots(endpoint: str, _url: str) -> None:
    """Case 66: ten brokers at once, each with a million endpoints."""
    declarations = [encode(frames.Node(number, f"/n{number}")) for number in range(1, 1_000_001)]
    with ExitStack() as stack, ThreadPoolExecutor() as threads:
        for number in (_number() for _ in range(10)):
            session = stack.enter_context(zenoh_client(endpoint, number))
            threads.submit(_serve, session, number, lambda: declarations)


def epochs(endpoint: str, _url: str) -> None:
    """Case 67: a broker that begins epoch after epoch, each of which makes others forget and ask for it."""
    number, epoch = _number(), count(1)
    mine = f"{PREFIX}/brokers/{broker_id(number)}"
    with zenoh_client(endpoint, number) as session:
        source = zenoh.SourceInfo(session.id, 0)

        def answer(query: zenoh.Query) -> None:
            if query.payload is not None:
                _, theirs = struct.unpack(">QQ", query.payload.to_bytes())
                snapshot = {"epoch": theirs, "version": 1, "declarations": list[bytes]()}
                query.reply(query.key_expr, msgspec.msgpack.encode(snapshot))

        kept = session.declare_queryable(f"{mine}/graph", answer), _announce(session, number)
        others = _brokers(session)
        while kept:
            now = next(epoch)
            for other in others:
                key, payload = f"{PREFIX}/brokers/{broker_id(other)}/graph", struct.pack(">QQ", number, now)
                session.get(key, lambda _: None, payload=payload, source_info=source)
            heartbeat = msgspec.msgpack.encode((1, dict.fromkeys(others, (now, 0)), {}))
            session.put(f"{mine}/heartbeat", heartbeat, source_info=source)
            time.sleep(0.0005)


def forged_samples(endpoint: str, _url: str) -> None:
    """Case 67: malformed samples, and well-formed ones, in the numbers of honest brokers."""
    undeclare = encode(frames.Undeclare(1))
    with zenoh_client(endpoint) as session:
        numbers = _brokers(session)
        while True:
            for number in numbers:
                mine = f"{PREFIX}/brokers/{broker_id(number)}"
                session.put(f"{mine}/changes", b"no frame", attachment=bytes(8))
                session.put(f"{mine}/changes", undeclare, attachment=struct.pack(">Q", 2**40))
                session.put(f"{mine}/heartbeat", msgspec.msgpack.encode((2**40, {}, {})))
            time.sleep(0.001)


def large_samples(endpoint: str, _url: str) -> None:
    """Case 68: samples of 400 MiB on the innocents' topic, and in a broker's number."""
    payload = bytes(LARGE)
    with zenoh_client(endpoint) as session:
        while True:
            session.put(f"{PREFIX}/topics/innocent", payload)
            session.put(f"{PREFIX}/brokers/{broker_id(_number())}/changes", payload)


def snapshot_queries(endpoint: str, _url: str) -> None:
    """Case 69: queries for snapshots, without end."""
    with zenoh_client(endpoint) as session:
        while True:
            for _ in range(50):
                session.get("callboard/1/*/brokers/*/graph", lambda _: None)
            list(session.get("callboard/1/*/brokers/*/graph"))


ATTACKS: Final = {
    "never-answering": Attack(64, never_answering, victim=MESH),
    "many-graphs": Attack(64, many_graphs, victim=MESH),
    "tokens": Attack(65, tokens, victim=MESH),
    "large-snapshot": Attack(66, large_snapshot, 400, victim=MESH),
    "large-snapshots": Attack(66, large_snapshots, 500, victim=MESH),
    "changing-snapshots": Attack(66, changing_snapshots, victim=MESH),
    "epochs": Attack(67, epochs, victim=MESH),
    "forged-samples": Attack(67, forged_samples, victim=MESH),
    "large-samples": Attack(68, large_samples, victim=MESH),
    "snapshot-queries": Attack(69, snapshot_queries, victim=MESH),
}
