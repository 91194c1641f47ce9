"""The router: peers that send any frames, freeze and vanish leave its tables consistent, and then empty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, get_args

from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto import limits
from proto.errors import ProtocolError
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.frames import SPECS, ReplyEntry, RequestEntry
from proto.wire.session import FROM_CLIENT
from tests.broker import frame_makers as make
from tests.broker.switch import Switch
from tests.fuzz.source import Source
from tests.seams.structure import of_router

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

MAX_STEPS: Final = 200
MAX_PEERS: Final = 5
OTHERS: Final = {
    *(frames.Ping, frames.Pong, frames.Fragment, frames.Abort, frames.Inspect, frames.Batch),
    *get_args(frames.SharedMemoryFrame),
}
"""Frames that the router does not get, and batches, which are made below."""
OPS: Final = sorted(op for op, spec in SPECS.items() if spec.frame in FROM_CLIENT - OTHERS)

NAMES: Final = (*("/a",) * 10, "/b", "/a/b", "", "a", "/a/*", "/" + "x" * 300)
NUMBERS: Final = (2**32 - 1, 2**63, 2**64 - 1, 1000)
QOS: Final[tuple[frames.Options, ...]] = (
    {},
    make.KEEP_ALL,
    make.LATCHED,
    {"depth": 1, "durability": 1},
    {"reliability": 2, "history": 2},
    {"depth": -1},
    {"liveliness": 2, "lease_ns": 10},
    {"history": None},
)


def check(data: bytes) -> None:
    """Let peers do what the bytes say."""
    source = Source(data)
    small = RouterLimits(max_endpoints=12, max_pending_calls=6)
    switch = Switch(Router(limits=small))
    peers = [switch.join(f"/node{n}") for n in range(2)]
    for _ in range(MAX_STEPS):
        if source.ended:
            break
        step(switch, peers, source)
    check_tables(switch)
    for peer in peers:
        switch.leave(peer)
    router = switch.router
    assert not len(router.graph)
    assert not router.topics.by_name.values()
    assert not router.routes.publishers.values()
    check_tables(switch)


def check_tables(switch: Switch) -> None:
    """Check that what belongs together agrees, and that every copy is somewhere."""
    assert list(of_router(switch.router)) == []
    routes = switch.router.routes
    tally, _ = routes.tallies()
    ended = tally.delivered + tally.dropped + tally.abandoned + tally.lost_on_break
    assert routes.copies == ended + tally.leaving + tally.queued


def step(switch: Switch, peers: list[int], source: Source) -> None:
    """Let one peer do one thing."""
    action = source.below(32)
    peer = peers[source.below(len(peers))]
    if action == 0 and len(peers) < MAX_PEERS:
        peers.append(switch.join(instance=bytes([source.below(4)]) * 16, token=bytes([source.below(2)]) * 16))
    elif action == 1 and len(peers) > 2:
        peers.remove(peer)
        switch.leave(peer)
    elif action == 2:
        switch.suspend(peer)
    elif action == 3:
        switch.congest(peer)
    elif action < 8:
        switch.read_all(peer, 1 + source.below(16))
    else:
        switch.restore(peer)  # whatever it sends is a sign of life
        try:
            switch.send(peer, decode(encode(any_frame(source))))
        except ProtocolError:
            switch.closed[peer] = 0
    for closed in set(switch.closed) & set(peers):
        peers.remove(closed)
        switch.leave(closed)
    switch.closed.clear()
    while len(peers) < 2:
        peers.append(switch.join())


def any_frame(source: Source) -> frames.Frame:
    """Return a valid frame whose numbers often mean something."""
    choice = source.below(len(OPS) + 6)
    if choice >= len(OPS):
        return make.batch(number(source), number(source), 1 + source.below(3), 10 + source.below(200))
    spec = SPECS[OPS[choice]]
    frame: frames.Frame = spec.frame(*(VALUES[kind](source) for kind in spec.kinds))
    return frame


def number(source: Source) -> int:
    """Return an integer, mostly a small one."""
    value = source.below(32)
    return value if value < 28 else NUMBERS[value - 28]


def _optional(value: Callable[[Source], Any]) -> Callable[[Source], Any]:
    return lambda source: value(source) if source.below(4) else None


def _list(value: Callable[[Source], Any]) -> Callable[[Source], Any]:
    return lambda source: tuple(value(source) for _ in range(source.below(4)))


def _request(source: Source) -> RequestEntry:
    return RequestEntry(number(source), None, None, bytes(source.below(64)))


def _reply(source: Source) -> ReplyEntry:
    return ReplyEntry(number(source), source.below(8), more=False, attributes=None, body=b"a")


VALUES: Final[Mapping[str, Callable[[Source], Any]]] = {
    "u32": lambda source: min(number(source) % 12, limits.MAX_U32),
    "u32?": _optional(number),
    "u64": number,
    "u64?": _optional(number),
    "u64s": _list(number),
    "bool": lambda source: bool(source.below(2)),
    "str": lambda source: NAMES[source.below(len(NAMES))],
    "str?": _optional(lambda source: NAMES[source.below(len(NAMES))]),
    "bin16": lambda source: bytes([source.below(3)]) * 16,
    "definition?": _optional(lambda source: bytes(source.below(16))),
    "map": lambda source: QOS[source.below(8)],
    "requests": _list(_request),
    "replies": _list(_reply),
}
"""A value of each kind of field."""
