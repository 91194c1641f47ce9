"""A process with the edge of a bridge, whose mirrors a test controls."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces import cdr
from actors.interfaces.message import type_name
from tests.real_ros.sides import REAL_COMMAND, Side
from tests.ros2.ros import DEPTH_10, WAIT_SEC

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.interfaces.message import Message
    from actors.qos.profile import QoSProfile

COMMAND: Final = (*REAL_COMMAND, "tests.ros2.programs")


class Edge:
    """A process of `programs/edge.py`.

    Args:
        environ: Variables of ROS 2.
        bridge_id: The ID of the bridge.
    """

    def __init__(self, environ: Mapping[str, str], bridge_id: str) -> None:
        self._side = Side(COMMAND, environ)
        self.started: dict[str, object] = self._side.call("edge.start", bridge_id)
        self.bridge_id = bridge_id

    async def ask(self, function: str, *args: object) -> Any:
        """Call a function in the process, and return what it returns.

        Raises:
            SideError: It has raised, or the process has ended.
        """
        return await asyncio.to_thread(self._side.call, f"edge.{function}", *args)

    async def error_of(self, function: str, *args: object) -> str:
        """Return the text of the RosError that a function raises."""
        answer = await asyncio.to_thread(self._side.ask, f"edge.{function}", *args)
        assert [*answer.raised][:1] == ["RosError"], answer
        return answer.text

    async def mirror(self, name: str) -> int:
        """Show a node."""
        return int(await self.ask("mirror", name))

    async def publisher(self, node: int, topic: str, cls: Any, qos: QoSProfile = DEPTH_10) -> int:
        """Show a publisher of one of callboard's message classes."""
        return int(await self.ask("publisher", node, topic, type_name(cls), dict(qos.to_wire())))

    async def publish(self, publisher: int, *messages: Message) -> None:
        """Publish messages."""
        await self.ask("publish", publisher, [cdr.encode(each).hex() for each in messages])

    async def subscription(
        self, node: int, topic: str, cls: Any, qos: QoSProfile = DEPTH_10, *, listens: bool = True
    ) -> int:
        """Show a subscription."""
        parts = topic, type_name(cls), dict(qos.to_wire())
        return int(await self.ask("subscription", node, *parts, listens))

    async def received(self, subscription: int, count: int) -> list[list[Any]]:
        """Wait for so many messages; return CDR, gid, sequence number and source stamp of all."""
        found: list[list[Any]] = await self.ask("received", subscription, count, WAIT_SEC)
        assert len(found) >= count, found
        return found

    async def matched(self, endpoint: int, count: int = 1) -> None:
        """Wait until a publisher or subscription has so many others."""
        assert await self.ask("matched", endpoint, count, WAIT_SEC) == count

    async def graph(
        self,
        *endpoints: tuple[str, str, str],
        nodes: Sequence[tuple[str, str]] = (),
        absent: Sequence[tuple[str, ...]] = (),
    ) -> tuple[list[list[str]], list[list[str]]]:
        """Wait until ROS's graph has endpoints and nodes, and not others; return its nodes and endpoints.

        Args:
            *endpoints: Node, kind and name of each.
            nodes: Name and origin of each.
            absent: As `endpoints`, or a node's name alone.
        """
        names, found = await self.ask("graph", nodes, endpoints, absent, WAIT_SEC)
        assert all([*each] in found for each in endpoints), found
        assert all([*each] in names for each in nodes), names
        present = [*found, *([name] for name, _ in names)]
        assert not [each for each in absent if [*each] in present], present
        return names, found

    async def reset(self) -> None:
        """End all that is shown."""
        await self.ask("destroy_all")

    def close(self) -> None:
        """End the process."""
        self._side.close()
