"""`~/get_diagnostics`: what a node tells others about itself."""

from __future__ import annotations

import os
import socket
from typing import TYPE_CHECKING

import pytest

from actors.errors import ServiceUnavailable
from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Empty
from actors.node import diagnostics_service
from tests.actors.meeting import until

if TYPE_CHECKING:
    import actors
    from tests.actors.meeting import Meeting


async def ask(node: actors.Node) -> GetDiagnostics.Response:
    """Ask the node `/ns/server`."""
    client = node.create_client(GetDiagnostics, "/ns/server/get_diagnostics")
    return await client.call(GetDiagnostics.Request())


async def test_it_says_where_the_node_runs_and_what_its_callbacks_take(meeting: Meeting) -> None:
    """The process, the uptime, and the callbacks that were called, the busiest first."""
    server = await meeting.node("server", namespace="ns", start_diagnostics_service=True)
    heard: list[String] = []

    def hear(message: String) -> None:
        heard.append(message)

    def fail(_: Empty.Request) -> Empty.Response:
        raise OSError("broken")

    def never(_: String) -> None:
        raise AssertionError

    server.create_subscription(String, "chatter", hear, 10)
    server.create_subscription(String, "silence", never, 10)
    server.create_service(Empty, "fail", fail)
    asker = await meeting.node("asker")
    publisher = asker.create_publisher(String, "/ns/chatter", 10)
    await until(publisher.get_subscription_count)
    publisher.publish(String())
    publisher.publish(String())
    await until(lambda: len(heard) == 2)
    with pytest.raises(Exception, match="broken"):
        await asker.create_client(Empty, "/ns/fail").call(Empty.Request())
    found = await ask(asker)
    assert (found.host, found.pid) == (socket.gethostname(), os.getpid())
    assert found.uptime_sec > 0
    assert found.stamp.sec > 0
    assert (found.connections, found.callback_errors) == (1, 1)
    assert {(each.kind, each.source, each.calls) for each in found.callbacks} >= {
        ("subscription", "/ns/chatter", 2),
        ("service", "/ns/fail", 1),
    }
    assert next(each.name for each in found.callbacks if each.source == "/ns/chatter").endswith("hear")
    assert "/ns/silence" not in {each.source for each in found.callbacks}
    busy = [each.busy_sec for each in found.callbacks]
    assert busy == sorted(busy, reverse=True)
    assert found.omitted_callbacks == 0


async def test_a_node_with_many_callbacks_says_how_many_it_leaves_out(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A response stays small."""
    monkeypatch.setattr(diagnostics_service, "MAX_CALLBACKS", 1)
    server = await meeting.node("server", namespace="ns", start_diagnostics_service=True)
    for name in "abc":
        server.create_service(Empty, name, lambda _: Empty.Response())
    asker = await meeting.node("asker")
    for name in "abc":
        await asker.create_client(Empty, f"/ns/{name}").call(Empty.Request())
    found = await ask(asker)
    assert (len(found.callbacks), found.omitted_callbacks) == (1, 3)  # with that which answers


async def test_a_node_can_do_without(meeting: Meeting) -> None:
    """`start_diagnostics_service=False`."""
    await meeting.node("server", namespace="ns", start_diagnostics_service=False)
    with pytest.raises(ServiceUnavailable):
        await ask(await meeting.node("asker"))
