"""Waits for what callboard's graph shows."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.bridges.graph import BRIDGE_ID_LABEL, BRIDGE_STATE_LABEL
from actors.graph.snapshot import GraphSnapshot
from actors.interfaces.std_srvs.srv import Trigger
from proto.wire.codes import EntryKind
from tests.ros2.ros import WAIT_SEC

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import EndpointInfo

POLL_SEC: Final = 0.02
KINDS: Final = {
    "publishers": EntryKind.PUBLISHER,
    "subscriptions": EntryKind.SUBSCRIPTION,
    "services": EntryKind.SERVICE,
    "clients": EntryKind.CLIENT,
}


async def graph_until(node: actors.Node, condition: Callable[[GraphSnapshot], object]) -> GraphSnapshot:
    """Wait until the graph of a node is as wanted; return it. The broker need not be there all the time."""
    snapshot = GraphSnapshot()
    try:
        async with asyncio.timeout(WAIT_SEC):
            while True:
                with suppress(actors.BrokerUnreachable):
                    snapshot = await node.get_graph()
                    if condition(snapshot):
                        return snapshot
                await asyncio.sleep(POLL_SEC)
    except TimeoutError:
        shown = [(name, info.endpoint_type.name, full_name(info)) for name, info in snapshot.all_endpoints()]
        raise AssertionError(f"the graph is {snapshot.node_labels()}, {shown}") from None


async def nodes_until(node: actors.Node, *wanted: str, absent: tuple[str, ...] = ()) -> list[str]:
    """Wait until some nodes are in the graph and others are not; return all names."""

    def is_right(snapshot: GraphSnapshot) -> bool:
        names = {*snapshot.nodes()}
        return {*wanted} <= names and not {*absent} & names

    return (await graph_until(node, is_right)).nodes()


async def endpoints_until(node: actors.Node, kind: str, name: str, count: int) -> list[EndpointInfo]:
    """Wait for so many endpoints of a topic or service; return them.

    Args:
        node: The node that asks.
        kind: One of `KINDS`.
        name: The topic or service.
        count: How many are waited for.
    """
    found = await graph_until(node, lambda graph: len(graph.endpoints(KINDS[kind], name)) == count)
    return found.endpoints(KINDS[kind], name)


def names_of(snapshot: GraphSnapshot, node: str) -> dict[str, dict[str, list[str]]]:
    """Return what a node has, by kind: names and types."""
    return {name: dict(snapshot.names_and_types(kind, node=node)) for name, kind in KINDS.items()}


def full_name(endpoint: EndpointInfo) -> str:
    """Return the full name of an endpoint's node."""
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


async def report_until(node: actors.Node, condition: Callable[[Any], object]) -> Any:
    """Ask the bridge for its report until it is as wanted; return it."""

    def bridges(snapshot: GraphSnapshot) -> list[str]:
        labels = snapshot.node_labels().items()
        return [name for name, each in labels if BRIDGE_ID_LABEL in each and BRIDGE_STATE_LABEL not in each]

    (bridge,) = bridges(await graph_until(node, bridges))
    client = node.create_client(Trigger, f"{bridge}/get_report")
    assert await client.wait_for_service(WAIT_SEC)
    report: Any = None
    try:
        async with asyncio.timeout(WAIT_SEC):
            while report is None or not condition(report):
                await asyncio.sleep(POLL_SEC)
                report = json.loads((await client.call(Trigger.Request())).message)
    except TimeoutError:
        raise AssertionError(f"the report is {report}") from None
    client.destroy()
    return report


async def wait_for_refusal(node: actors.Node, name: str, reason: str, *parts: str) -> None:
    """Wait until a bridge's report says that something does not cross, in a text with some parts."""

    def is_right(report: Any) -> bool:
        texts = [
            each["text"] for each in report["refusals"] if (each["name"], each["reason"]) == (name, reason)
        ]
        return any(all(part in text for part in parts) for text in texts)

    await report_until(node, is_right)
