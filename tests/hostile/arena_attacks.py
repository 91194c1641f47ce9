"""Attacks of full size with shared memory."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import ExitStack, closing, suppress
from typing import Final

from broker.serving.shared_memory import MAX_ARENAS
from proto import limits
from proto.aio.arena import ARENA_BYTES, Arena, host_identity
from proto.wire import frames
from proto.wire.references import SLOT_HEAD_BYTES
from tests.broker import frame_makers as make
from tests.hostile.attacks import MIB, Link
from tests.hostile.victims import Attack, broker_with

SPARSE: Final = 24
PART_BYTES: Final = MIB // 2


def sparse_arenas(url: str) -> None:
    """Case 87: arenas of which one page is written, and references to all of each for a reader."""
    with ExitStack() as stack:
        reader = stack.enter_context(closing(Link(url)))
        reader.send(make.subscription(1, "/sparse", raw=True, qos={"depth": limits.MAX_DEPTH}))
        threading.Thread(target=reader.drain, daemon=True).start()
        arenas: list[Arena] = []
        for _ in range(SPARSE):
            link = stack.enter_context(closing(Link(url, host_identity())))
            arenas.append(arena := Arena(ARENA_BYTES))
            number = link.publisher(make.publisher(1, "/sparse")._replace(gid=os.urandom(16)))
            link.send(arena.announcement)
            threading.Thread(target=link.drain, daemon=True).start()
            place = arena.announcement.id
            size = PART_BYTES - SLOT_HEAD_BYTES
            for sequence, offset in enumerate(range(4096, ARENA_BYTES - PART_BYTES, PART_BYTES)):
                head = number, sequence, 1, 1, None, None
                with suppress(OSError):  # the broker has not mapped it, and closes
                    link.send(frames.Reference(*head, place, offset, SLOT_HEAD_BYTES, size, 0))
        threading.Event().wait()


def many_arenas(url: str) -> None:
    """Case 88: one process with as many arenas as the broker maps."""
    with ExitStack() as stack:
        arenas: list[Arena] = []
        links: list[Link] = []
        for _ in range(MAX_ARENAS):
            arenas.append(Arena(4096))
            links.append(stack.enter_context(closing(Link(url, host_identity()))))
            links[-1].send(arenas[-1].announcement)
        refused = sum(bool(link.wait(frames.Mapped).problem) for link in links)
        sys.stderr.write(f"{refused} of {MAX_ARENAS} arenas refused\n")
        threading.Event().wait()


SMALL: Final = broker_with("small", "--max-broker-bytes", "100000000")

ATTACKS: Final = {
    "sparse-arenas": Attack(87, sparse_arenas, victim=SMALL),
    "many-arenas": Attack(88, many_arenas),
}
