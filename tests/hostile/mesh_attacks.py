"""Attacks of full size on a broker of a mesh; their target is its Zenoh endpoint, and its URL."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import zenoh

from tests.hostile.victims import MESH, Attack

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def zenoh_client(endpoint: str) -> Iterator[zenoh.Session]:
    """Open a session of a client, which finds nobody but the broker."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    session = zenoh.open(config)
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]


def snapshot_queries(endpoint: str, _url: str) -> None:
    """Case 69: queries for snapshots, without end."""
    with zenoh_client(endpoint) as session:
        while True:
            for _ in range(50):
                session.get("callboard/1/*/brokers/*/graph", lambda _: None)
            list(session.get("callboard/1/*/brokers/*/graph"))


ATTACKS: Final = {"snapshot-queries": Attack(69, snapshot_queries, victim=MESH)}
