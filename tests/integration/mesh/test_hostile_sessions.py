"""A session of Zenoh that is let into a mesh and is no broker: honest brokers notice nothing of it."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from __future__ import annotations

import json
import secrets
import struct
from contextlib import contextmanager
from typing import TYPE_CHECKING

import msgspec
import zenoh

from broker.mesh import wire
from broker.mesh.messages import Heartbeat, Snapshot
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.mesh_keys import broker_id
from tests.integration.mesh.stations import (
    MeshBroker,
    Station,
    check_traffic,
    make_brokers,
    start_all,
    wait_until_joined,
)

if TYPE_CHECKING:
    from collections.abc import Generator
    from contextlib import AsyncExitStack

    from tests.integration.conftest import System

PREFIX = "callboard/1/0"
PAIR = ((), (0,))


@contextmanager
def open_client(endpoint: str) -> Generator[zenoh.Session]:
    """Open a session that is connected to one broker."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    session = zenoh.open(config)
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]


def find_brokers(session: zenoh.Session, count: int) -> list[int]:
    """Return the numbers of the brokers that answer queries for their snapshots."""
    found: set[int] = set()
    while len(found) < count:
        replies = session.get(f"{PREFIX}/brokers/*/graph", timeout=1.0)
        found |= {int(str(each.ok.key_expr).split("/")[4], 16) for each in replies if each.ok is not None}
    return sorted(found)


async def test_samples_in_the_number_of_another_broker_are_ignored(
    system: System, stack: AsyncExitStack
) -> None:
    """Case 67: malformed ones, and well-formed ones that would remove what it has."""
    brokers = make_brokers(system, PAIR)
    stations = await start_all(brokers, stack)
    with open_client(brokers[0].endpoint) as session:
        for number in find_brokers(session, 2):
            mine = f"{PREFIX}/brokers/{broker_id(number)}"
            session.put(f"{mine}/changes", b"no frame", attachment=bytes(8))
            session.put(f"{mine}/heartbeat", b"no heartbeat")
            for version in range(1, 40):
                attachment = struct.pack(">Q", version)
                session.put(f"{mine}/changes", encode(frames.Undeclare(version)), attachment=attachment)
            session.put(f"{mine}/heartbeat", wire.encode_heartbeat(Heartbeat(2**40, {})))
        await check_traffic(*stations)
    await check_traffic(*stations)
    for broker in brokers:
        assert broker.program is not None
        assert "rejected" not in broker.program.output


async def test_answers_and_tokens_of_others_keep_no_broker_out(system: System, stack: AsyncExitStack) -> None:
    """Cases 64, 65 and 69: false snapshots under every key, tokens that nobody answers for, and queries."""
    brokers = make_brokers(system, PAIR)
    stations = await start_all(brokers, stack)
    false = wire.encode_snapshot(Snapshot(2**40, 2**40, (), "false"))

    def answer(query: zenoh.Query) -> None:
        query.reply(str(query.key_expr), false)

    with open_client(brokers[0].endpoint) as session:
        alive = session.liveliness()
        kept = [
            session.declare_queryable(f"{PREFIX}/brokers/*/graph", answer, complete=True),
            *(alive.declare_token(f"{PREFIX}/alive/{secrets.randbits(32):08x}") for _ in range(50)),
        ]
        late = await MeshBroker(system, [brokers[0]]).start()
        stations.append(await stack.enter_async_context(Station("late", late.url)))
        await wait_until_joined(*stations)
        for _ in range(30):
            session.get(f"{PREFIX}/brokers/*/graph", lambda _: None, payload=msgspec.msgpack.encode(0) * 16)
        await check_traffic(*stations)
        assert len(kept) == 51
