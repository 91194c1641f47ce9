"""docs/reference/http.md against the routes."""

from __future__ import annotations

import re
from pathlib import Path

from actors.web import limits, log_reader, topic_feed, worker
from actors.web.server import ROUTES

DOCUMENT = (Path(__file__).parents[3] / "docs" / "reference" / "http.md").read_text(encoding="utf-8")


def test_every_route_is_documented_and_nothing_else() -> None:
    """Names and ids are placeholders; queries are left out."""
    routes = {
        (
            route.method,
            re.sub(r"\{goal[^}]*\}+", "ID", re.sub(r"\{name:[^}]*\}", "NAME", route.pattern)).rstrip("}"),
        )
        for route in ROUTES
    }
    documented = set(re.findall(r"`(GET|POST|PATCH|DELETE) ([^`?]*)(?:\?[^`]*)?`", DOCUMENT))
    assert documented == routes


def test_the_limits_are_those_of_the_code() -> None:
    """For one user or address, and for all."""
    mib, kib = 1024 * 1024, 1024
    one, total = limits.MAX_HOLDER_HELD_BYTES // mib, limits.MAX_HELD_BYTES // mib
    unread_of_one = limits.MAX_HOLDER_UNREAD_BYTES // mib
    for text in (
        f"handshake of TLS | {limits.MAX_HOLDER_CONNECTIONS} | {limits.MAX_CONNECTIONS} |",
        f"among them | {limits.MAX_HOLDER_STREAMS} | {limits.MAX_STREAMS} |",
        f"received or handled | {one} MiB | {total} MiB |",
        f"accepted before | {limits.MAX_SIGN_INS_OF_ADDRESS} | {limits.MAX_SIGN_INS} |",
        f"last minute count | {limits.MAX_USER_ADDRESSES} | {limits.MAX_USERS} |",
        f"clients read them | {unread_of_one} MiB | {limits.MAX_UNREAD_BYTES // mib} MiB |",
        f"| {limits.FIRST_BYTE_SEC:g} s |",
        f"| {limits.UNREAD_SEC:g} s |",
        f"have arrived | {limits.KEEPALIVE_SEC:g} s |",
        f"a user reads at the same time | {topic_feed.MAX_TOPICS} |",
        f"of all who are no user | {log_reader.MAX_READERS} |",
        f"thread which makes them | {worker.MAX_WAITING} |",
        f"did not arrive within {limits.BODY_SEC:g} s (for signing in, {limits.SIGN_IN_SEC:g} s)",
        f"{limits.MAX_BODY_BYTES // mib} MiB (for signing in, {limits.MAX_SIGN_IN_BYTES // kib} KiB)",
    ):
        assert text in DOCUMENT
