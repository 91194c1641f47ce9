"""Endpoints that a bridge shows in ROS 2, and how the loop learns of what has arrived there."""

from __future__ import annotations

import asyncio
import os
import warnings
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from actors.bridges.options import LEASE_SEC
from actors.bridges.ros2.arrivals import MAX_TAKES_PER_TURN, Arrivals
from actors.bridges.ros2.errors import RosError
from actors.bridges.ros2.importing import PROFILE_VARIABLE, profile_text
from actors.bridges.ros2.participant import Participant
from actors.qos.profile import QoSProfile
from actors.time.types import INFINITE
from tests.actors.bridges.ros2_stand_in import (
    SERVICE_CLASS,
    Handle,
    InvalidHandle,
    Network,
    make_ros,
    message,
)

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from actors.bridges.ros2.participant import RosNode

pytestmark = pytest.mark.skipif(not hasattr(os, "eventfd"), reason="needs eventfd")

DEPTH = QoSProfile(depth=10)


class Side:
    """A participant and its network."""

    def __init__(self, *, has_own_profile: bool = False) -> None:
        self.network = Network()
        self.errors: list[Exception] = []
        self.ros = make_ros(self.network, has_own_profile=has_own_profile)
        arrivals = Arrivals(self.ros, asyncio.get_running_loop(), self.errors.append)
        self.participant = Participant(self.ros, bridge_id="one", arrivals=arrivals, domain_id=7)

    @property
    def node(self) -> RosNode:
        """The bridge's own node."""
        return self.participant.control


@pytest.fixture
async def side() -> AsyncIterator[Side]:
    """A participant, which ends with the test."""
    made = Side()
    yield made
    made.network.refuses = None
    made.participant.close()


async def turns(count: int = 3) -> None:
    """Let the loop turn."""
    for _ in range(count):
        await asyncio.sleep(0)


async def test_a_participant_marks_its_nodes(side: Side) -> None:
    """Its enclave names the bridge; gids of its endpoints are its own. Its end ends all nodes."""
    assert side.participant.domain_id == 7
    assert side.network.nodes == [("/callboard_bridge_one", "/callboard_bridge/one")]
    assert side.participant.is_own(side.network.endpoints[0].gid)
    assert not side.participant.is_own(bytes(16))
    side.participant.mirror_node("/inside/talker")
    side.participant.close()
    assert side.network.nodes == []


async def test_a_participant_sets_up_fast_dds(monkeypatch: pytest.MonkeyPatch) -> None:
    """While the first node is made, and for no other process."""
    seen: list[str] = []
    monkeypatch.delenv(PROFILE_VARIABLE, raising=False)
    make = Participant.mirror_node

    def mirror_node(self: Participant, name: str) -> RosNode:
        with open(os.environ[PROFILE_VARIABLE], encoding="utf-8") as file:  # noqa: PTH123
            seen.append(file.read())
        return make(self, name)

    monkeypatch.setattr(Participant, "mirror_node", mirror_node)
    Side(has_own_profile=True).participant.close()
    assert seen == [profile_text(LEASE_SEC)]
    assert f"<leaseDuration><sec>{LEASE_SEC}</sec>" in seen[0]
    assert PROFILE_VARIABLE not in os.environ


async def test_what_ros_refuses(side: Side) -> None:
    """The error says what was wanted, and the first line of the reason."""
    with pytest.raises(RosError, match=r"^ROS 2 refuses the node '/9x': Invalid node name$"):
        side.participant.mirror_node("/9x")
    side.network.refuses = RuntimeError()
    with pytest.raises(RosError, match=r"^ROS 2 refuses a publisher of '/t': RuntimeError$"):
        side.node.create_publisher(object, "/t", DEPTH)
    with pytest.raises(RosError, match="ROS 2 cannot start: the domain is negative"):
        Participant(
            side.ros,
            bridge_id="two",
            arrivals=Arrivals(side.ros, asyncio.get_running_loop(), print),
            domain_id=-1,
        )


async def test_messages_are_taken_in_shares(side: Side) -> None:
    """Case 92: at most so many in one turn of the loop; an exception of the callback stops no others."""
    taken: list[bytes] = []

    def callback(cdr: bytes, info: Any) -> None:
        taken.append(cdr)
        if info.sequence == 2:
            raise ValueError("two")

    subscription = side.node.create_subscription(object, "/t", DEPTH, None)
    pointer = next(reversed(side.network.queues))
    for number in range(MAX_TAKES_PER_TURN + 2):
        side.network.arrive(pointer, message(number))
    await turns()
    assert taken == []
    subscription.listen(callback)
    while not taken:
        await asyncio.sleep(0)
    assert len(taken) == MAX_TAKES_PER_TURN
    await turns()
    assert len(taken) == MAX_TAKES_PER_TURN + 2
    assert [str(each) for each in side.errors] == ["two"]
    subscription.listen(None)
    side.network.arrive(pointer, message(99))
    await turns()
    assert len(taken) == MAX_TAKES_PER_TURN + 2
    assert subscription.publisher_count() == 1


async def test_a_message_that_arrives_while_the_callback_is_set(side: Side) -> None:
    """ROS 2 says nothing of it, and it is taken all the same."""
    received: list[bytes] = []
    subscription = side.node.create_subscription(object, "/t", DEPTH, None)
    next(reversed(side.network.queues.values())).append(message(1))
    side.network.is_silent = True
    subscription.listen(lambda cdr, _: received.append(cdr))
    await turns()
    assert received == [b"1"]


async def test_a_take_that_fails_is_reported_and_tried_again(
    side: Side, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What has arrived is taken after a pause."""
    monkeypatch.setattr("actors.bridges.ros2.arrivals.RETRY_SEC", 0.0)
    taken: list[bytes] = []
    side.node.create_subscription(object, "/t", DEPTH, lambda cdr, _: taken.append(cdr))
    pointer = next(reversed(side.network.queues))
    side.network.queues[pointer].append(RosError("once"))
    side.network.arrive(pointer, message(1))
    while not taken:
        await asyncio.sleep(0)
    assert [str(each) for each in side.errors] == ["once"]


async def test_an_endpoint_that_cannot_be_waited_for(side: Side, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit of open files is named, and the endpoint is not shown."""
    before = len(side.network.endpoints)

    def eventfd(*_: int) -> int:
        raise OSError(24, "Too many open files")

    monkeypatch.setattr(os, "eventfd", eventfd)
    with pytest.raises(RosError, match=r"Too many open files\): raise the limit of open files"):
        side.node.create_subscription(object, "/t", DEPTH, print)
    assert len(side.network.endpoints) == before


async def test_a_callback_that_ros_does_not_accept(side: Side, monkeypatch: pytest.MonkeyPatch) -> None:
    """The code is in the error."""
    monkeypatch.setattr(side.ros.rcl, "rcl_subscription_set_on_new_message_callback", lambda *_: 1)
    with pytest.raises(RosError, match="rcl_subscription_set_on_new_message_callback failed with code 1"):
        side.node.create_subscription(object, "/t", DEPTH, print)


async def test_a_publisher(side: Side) -> None:
    """It sends bytes; a destroyed one refuses them."""
    limited = QoSProfile(depth=1, deadline=2.0, lifespan=INFINITE)
    publisher = side.node.create_publisher(object, "/t", limited)
    profile = side.network.endpoints[-1].qos
    assert (profile.deadline.nanoseconds, profile.lifespan.nanoseconds) == (2_000_000_000, 0)
    publisher.publish(b"one")
    assert side.network.published == [b"one"]
    assert publisher.subscription_count() == 2
    publisher.destroy()
    publisher.destroy()
    with pytest.raises(RosError, match="ROS 2 refuses a message: it has been destroyed"):
        publisher.publish(b"two")


async def test_a_client(side: Side) -> None:
    """Its callback gets the sequence number and the response."""
    taken: list[tuple[int, Any]] = []
    client = side.node.create_client(SERVICE_CLASS, "/s", lambda *each: taken.append(each), qos=DEPTH)
    pointer = next(reversed(side.network.queues))
    assert client.is_ready()
    assert client.send("asked") == 1
    with pytest.raises(RosError, match="ROS 2 refuses a request: out of range"):
        client.send(OverflowError("out of range"))
    header = SimpleNamespace(request_id=SimpleNamespace(sequence_number=1))
    side.network.arrive(pointer, (header, "answered"))
    while not taken:
        await asyncio.sleep(0)
    assert taken == [(1, "answered")]


async def test_a_service(side: Side, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its callback gets the request and what the response needs; a response that is lost is an error."""
    taken: list[tuple[Any, Any]] = []
    service = side.node.create_service(SERVICE_CLASS, "/s", lambda *each: taken.append(each))
    pointer = next(reversed(side.network.queues))
    header = SimpleNamespace(request_id="number 1")
    side.network.arrive(pointer, ("asked", header))
    while not taken:
        await asyncio.sleep(0)
    assert taken == [("asked", header)]
    service.respond("answered", header)
    assert side.network.published == [("answered", "number 1")]

    def warn(*_: object) -> None:
        warnings.warn("the client is not reached", RuntimeWarning, stacklevel=1)

    monkeypatch.setattr(Handle, "service_send_response", warn)
    with pytest.raises(RosError, match="ROS 2 loses a response: the client is not reached"):
        service.respond("answered", header)
    side.node.destroy()
    with pytest.raises(RosError):
        service.respond("answered", header)
    with pytest.raises(InvalidHandle), side.node.rclpy_node.handle:
        pass
