"""A process of real ROS 2 whose nodes a test controls, while callboard's nodes of the test go on."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces import cdr
from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from actors.qos.profile import QoSProfile
from tests.real_ros.sides import REAL_COMMAND, Side, SideError

if TYPE_CHECKING:
    import signal
    from collections.abc import Mapping, Sequence

    from actors.interfaces.message import Message

WAIT_SEC: Final = 50.0
"""For any single event, on a machine that is busy; less than the side's own limit for an answer."""
DEPTH_10: Final = QoSProfile(depth=10)


class Ros:
    """A process of `programs/nodes.py`. Its methods are that module's functions.

    Args:
        environ: Variables of ROS 2.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        self._side = Side((*REAL_COMMAND, "tests.ros2.programs"), environ)
        self._asking = asyncio.Lock()

    async def ask(self, function: str, *args: object) -> Any:
        """Call a function in the process, and return what it returns.

        Raises:
            SideError: It has raised, or the process has ended.
        """
        async with self._asking:
            return await asyncio.to_thread(self._side.call, f"nodes.{function}", *args)

    async def node(self, name: str, namespace: str = "/", **parameters: object) -> RosNode:
        """Make a node."""
        number = await self.ask("make_node", name, namespace, parameters)
        return RosNode(self, number, f"{namespace.rstrip('/')}/{name}")

    async def lifecycle_node(self, name: str) -> RosNode:
        """Make a lifecycle node."""
        return RosNode(self, await self.ask("make_lifecycle_node", name), f"/{name}")

    async def kill(self) -> None:
        """Let the process die without a goodbye."""
        try:
            await self.ask("kill")
        except SideError:
            return
        raise AssertionError("the process has answered")

    def output(self) -> str:
        """Return what it has written to stderr since its start, or since the last call."""
        return self._side.output()

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal to the process."""
        self._side.send_signal(number)

    def close(self) -> None:
        """End the process."""
        self._side.close()


@dataclass(frozen=True)
class RosNode:
    """A node of a `Ros` process.

    Attributes:
        ros: The process.
        number: What its functions know the node by.
        name: The node's full name.
    """

    ros: Ros
    number: int
    name: str

    async def publisher(self, topic: str, cls: type, qos: QoSProfile = DEPTH_10) -> RosPublisher:
        """Make a publisher of one of callboard's message classes."""
        made = await self.ros.ask("make_publisher", self.number, topic, type_name(cls), _parts(qos))
        return RosPublisher(self.ros, made)

    async def subscription(
        self, topic: str, cls: Any, qos: QoSProfile = DEPTH_10, *, raw: bool = False
    ) -> RosSubscription:
        """Make a subscription."""
        made = await self.ros.ask("make_subscription", self.number, topic, type_name(cls), _parts(qos), raw)
        return RosSubscription(self.ros, made, cls)

    async def service(
        self,
        name: str,
        cls: Any,
        response: Message,
        *,
        held: bool = False,
        qos: QoSProfile | None = None,
    ) -> RosService:
        """Make a service that gives one response, at once or, if `held`, once it is told to."""
        data = cdr.encode(response).hex()
        profile = None if qos is None else _parts(qos)
        made = await self.ros.ask("make_service", self.number, name, type_name(cls), data, held, profile)
        return RosService(self.ros, made, cls)

    async def client(self, name: str, cls: Any) -> RosClient:
        """Make a client."""
        made = await self.ros.ask("make_client", self.number, name, type_name(cls))
        return RosClient(self.ros, made, cls)

    async def action_server(
        self,
        name: str,
        cls: Any,
        result: Message,
        feedback: Sequence[Message] = (),
        *,
        ending: str = "succeed",
    ) -> RosActionServer:
        """Make an action server. `ending` is "succeed", "abort", "reject" or "later", for `end_goals`."""
        parts = cdr.encode(result).hex(), [cdr.encode(each).hex() for each in feedback]
        made = await self.ros.ask("make_action_server", self.number, name, type_name(cls), *parts, ending)
        return RosActionServer(self.ros, made, cls)

    async def action_client(self, name: str, cls: Any) -> RosActionClient:
        """Make an action client."""
        made = await self.ros.ask("make_action_client", self.number, name, type_name(cls))
        return RosActionClient(self.ros, made, cls)

    async def node_names(self, *wanted: str, absent: Sequence[str] = ()) -> list[str]:
        """Wait until some nodes are in ROS's graph and others are not; return all.

        Raises:
            AssertionError: They were not in time.
        """
        found: list[str] = await self.ros.ask("node_names", self.number, wanted, absent, WAIT_SEC)
        assert {*wanted} <= {*found}, found
        assert not {*absent} & {*found}, found
        return found

    async def names_of(self, full_name: str) -> dict[str, dict[str, list[str]]]:
        """Return what a node has in ROS's graph: kinds, names and types."""
        namespace, _, name = full_name.rpartition("/")
        found: dict[str, dict[str, list[str]]] = await self.ros.ask(
            "names_of", self.number, name, namespace or "/"
        )
        return found

    async def endpoints(self, topic: str, kind: str, count: int) -> list[list[str]]:
        """Wait for so many endpoints of a topic; return node, type, hash, reliability, durability of each."""
        found: list[list[str]] = await self.ros.ask("endpoints", self.number, topic, kind, count, WAIT_SEC)
        assert len(found) == count, found
        return found

    async def service_count(self, name: str, wanted: int) -> None:
        """Wait until a service has so many servers."""
        assert await self.ros.ask("count_services", self.number, name, wanted, WAIT_SEC) == wanted

    async def ask(self, function: str, *args: object) -> Any:
        """Call a function that takes a node."""
        return await self.ros.ask(function, self.number, *args)

    async def destroy(self) -> None:
        """End the node."""
        await self.ros.ask("destroy_node", self.number)


@dataclass(frozen=True)
class RosPublisher:
    """A publisher of a `Ros` process."""

    ros: Ros
    number: int

    async def publish(self, *messages: Message) -> None:
        """Publish messages."""
        await self.ros.ask("publish", self.number, [cdr.encode(each).hex() for each in messages])

    async def publish_raw(self, *messages: bytes) -> None:
        """Publish CDR as it is."""
        await self.ros.ask("publish", self.number, [each.hex() for each in messages], True)

    async def matched(self, count: int = 1) -> None:
        """Wait until so many subscriptions are there."""
        found = await self.ros.ask("count_subscriptions", self.number, count, WAIT_SEC)
        assert found == count, f"{found} subscriptions"

    async def acknowledged(self) -> None:
        """Wait until the subscriptions have got what was published."""
        assert await self.ros.ask("acknowledged", self.number, WAIT_SEC)

    async def destroy(self) -> None:
        """End it."""
        await self.ros.ask("destroy_publisher", self.number)


@dataclass(frozen=True)
class RosSubscription:
    """A subscription of a `Ros` process."""

    ros: Ros
    number: int
    cls: Any

    async def received(self, count: int) -> list[Any]:
        """Wait for so many messages; return all that are there.

        Raises:
            AssertionError: There were fewer in time.
        """
        return [message for message, _ in await self.received_with_stamps(count)]

    async def received_with_stamps(self, count: int) -> list[tuple[Any, int]]:
        """Return messages with their source stamps in nanoseconds."""
        found = await self.ros.ask("received", self.number, count, WAIT_SEC)
        messages = [(cdr.decode(self.cls, bytes.fromhex(data)), stamp) for data, stamp in found]
        assert len(messages) >= count, messages
        return messages

    async def count(self, seconds: float) -> int:
        """Wait for a message for a while; return how many have arrived."""
        return len(await self.ros.ask("received", self.number, 1, seconds))

    async def take_texts(self) -> list[str]:
        """Return the texts of String messages since the last call."""
        found: list[str] = await self.ros.ask("take_texts", self.number)
        return found

    async def matched(self, count: int = 1) -> None:
        """Wait until so many publishers are there."""
        found = await self.ros.ask("count_publishers", self.number, count, WAIT_SEC)
        assert found == count, f"{found} publishers"

    async def destroy(self) -> None:
        """End it."""
        await self.ros.ask("destroy_subscription", self.number)


@dataclass(frozen=True)
class RosService:
    """A service of a `Ros` process."""

    ros: Ros
    number: int
    cls: Any

    async def requests(self, count: int) -> list[Any]:
        """Wait for so many requests; return all that are there."""
        found = await self.ros.ask("requests", self.number, count, WAIT_SEC)
        assert len(found) >= count, found
        return [cdr.decode(self.cls.Request, bytes.fromhex(each)) for each in found]

    async def release(self) -> None:
        """Answer what is held back."""
        await self.ros.ask("release", self.number)

    async def destroy(self) -> None:
        """End it."""
        await self.ros.ask("destroy_service", self.number)


@dataclass(frozen=True)
class RosClient:
    """A client of a `Ros` process."""

    ros: Ros
    number: int
    cls: Any

    async def is_ready(self, seconds: float = WAIT_SEC) -> bool:
        """Return whether a server is there in time."""
        found: bool = await self.ros.ask("wait_for_service", self.number, seconds)
        return found

    async def send(self, *requests: Message) -> int:
        """Send requests; return the number of the calls."""
        number: int = await self.ros.ask("call", self.number, [cdr.encode(each).hex() for each in requests])
        return number

    async def responses(self, calls: int, count: int, seconds: float = WAIT_SEC) -> dict[int, Any]:
        """Wait for so many responses; return them by the position of their requests."""
        found = await self.ros.ask("responses", calls, count, seconds)
        return {place: cdr.decode(self.cls.Response, bytes.fromhex(data)) for place, data in found}

    async def call(self, request: Message) -> Any:
        """Wait for the server and for its response."""
        assert await self.is_ready()
        found = await self.responses(await self.send(request), 1)
        assert found, "no response"
        return found[0]


@dataclass(frozen=True)
class RosActionServer:
    """An action server of a `Ros` process."""

    ros: Ros
    number: int
    cls: Any

    async def goals(self, count: int) -> list[Any]:
        """Wait for so many goals; return all that are there."""
        found = await self.ros.ask("requests", self.number, count, WAIT_SEC)
        assert len(found) >= count, found
        return [cdr.decode(self.cls.Goal, bytes.fromhex(each)) for each in found]

    async def end_goals(self, ending: str) -> None:
        """End the goals: "succeed", "abort" or "canceled"."""
        await self.ros.ask("end_goals", self.number, ending)

    async def destroy(self) -> None:
        """End it."""
        await self.ros.ask("destroy_action_server", self.number)


@dataclass(frozen=True)
class RosActionClient:
    """An action client of a `Ros` process."""

    ros: Ros
    number: int
    cls: Any

    async def is_ready(self, seconds: float = WAIT_SEC) -> bool:
        """Return whether a server is there in time."""
        found: bool = await self.ros.ask("wait_for_action_server", self.number, seconds)
        return found

    async def send(self, goal: Message) -> RosGoal:
        """Send a goal once the server is there."""
        assert await self.is_ready()
        number = await self.ros.ask("send_goal", self.number, cdr.encode(goal).hex())
        return RosGoal(self.ros, number, self.cls)


@dataclass(frozen=True)
class RosGoal:
    """A goal that a client of a `Ros` process has sent."""

    ros: Ros
    number: int
    cls: Any

    async def state(self, what: str, *, feedback: int = 0) -> dict[str, Any]:
        """Wait until "accepted", "cancelled" or "result" is known; return all, decoded."""
        found = await self.ros.ask("goal_state", self.number, what, WAIT_SEC, feedback)
        assert found[what] is not None, found
        assert len(found["feedback"]) >= feedback, found
        result = found["result"]
        return {
            **found,
            "feedback": [cdr.decode(self.cls.Feedback, bytes.fromhex(each)) for each in found["feedback"]],
            "result": None if result is None else cdr.decode(self.cls.Result, bytes.fromhex(result)),
        }

    async def cancel(self) -> list[int]:
        """Ask for its end; return the code, and how many goals end."""
        await self.ros.ask("cancel_goal", self.number)
        found: list[int] = (await self.state("cancelled"))["cancelled"]
        return found


def interface(name: str) -> Any:
    """Return the class of a type of ROS 2, those of `test_msgs` included."""
    import tests.interfaces.imported  # noqa: F401, PLC0415 - it takes long, and few tests need `test_msgs`

    return find_interface(name)


def _parts(qos: QoSProfile) -> dict[str, object]:
    """Take a profile apart; times without a limit are left out."""
    times = {name: getattr(qos, name) for name in ("deadline", "lifespan", "liveliness_lease_duration")}
    policies = {
        name: getattr(qos, name).name for name in ("history", "reliability", "durability", "liveliness")
    }
    limited = {name: each.nanoseconds for name, each in times.items() if each.nanoseconds}
    return {"depth": qos.depth, **policies, **limited}
