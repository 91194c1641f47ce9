"""What the log says of a broker's connections to others."""

from __future__ import annotations

import asyncio
import re
import socket
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest

from broker.mesh.engine import neighbours

if TYPE_CHECKING:
    from collections.abc import Sequence


async def lines(
    endpoint: str, caplog: pytest.LogCaptureFixture, steps: Sequence[Sequence[str]], *others: str
) -> list[str]:
    """Return the lines of a watch that sees these neighbours, one step after the other."""
    left = list(steps)
    done = asyncio.Event()

    def found() -> Sequence[str]:
        if not left:
            done.set()
        return left.pop(0) if left else steps[-1]

    watching = asyncio.create_task(neighbours.watch(found, [endpoint, *others]))
    await asyncio.wait_for(done.wait(), 10)
    watching.cancel()
    with suppress(asyncio.CancelledError):
        await watching
    return [record.getMessage() for record in caplog.records]


@pytest.fixture(autouse=True)
def fast(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """Let a watch look often, and nobody be patient."""
    caplog.set_level("INFO", "callboard.broker")
    monkeypatch.setattr(neighbours, "PERIOD_SEC", 0.001)
    monkeypatch.setattr(neighbours, "GRACE_SEC", 0.0005)


async def test_an_endpoint_where_nobody_answers_is_named_once(caplog: pytest.LogCaptureFixture) -> None:
    """However long it lasts."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
        (line,) = await lines(endpoint, caplog, [[]] * 5)
    assert line.startswith(f"Mesh: no connection with {endpoint}: nobody answers there (")


async def test_an_endpoint_that_refuses_the_broker_is_told_apart(caplog: pytest.LogCaptureFixture) -> None:
    """Something listens there."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        (line,) = await lines(f"tcp/127.0.0.1:{server.getsockname()[1]}", caplog, [[]] * 5)
    assert "it does not let this broker in (another password" in line


async def test_an_endpoint_that_cannot_be_resolved_is_named(caplog: pytest.LogCaptureFixture) -> None:
    """A label of a host's name has at most 63 characters."""
    (line,) = await lines(f"tcp/{'a' * 64}.example:1", caplog, [[]] * 5)
    assert "nobody answers there (this is not a host name)" in line


async def test_an_endpoint_where_nobody_answers_is_named_beside_others(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Once, and not those where somebody does."""
    with socket.create_server(("127.0.0.1", 0)) as server, socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        ports = [each.getsockname()[1] for each in (server, free)]
        good, dead = (f"tcp/127.0.0.1:{port}" for port in ports)
        found = await lines(good, caplog, [["a"]] * 5, dead)
    assert [line.partition(": nobody")[0] for line in found[1:]] == [f"Mesh: no connection with {dead}"]


async def test_connections_that_come_and_go_are_told(caplog: pytest.LogCaptureFixture) -> None:
    """One line each."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        found = await lines(endpoint, caplog, [["a"], ["a", "b"], [], [], ["a"]])
    assert [re.split(r" \(| with", line)[0] for line in found] == [
        "Mesh: connected",
        "Mesh: no connection",
        "Mesh: connected",
    ]
