"""Publishers in ROS 2 of nodes that come, publish and go."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from actors.bridges.counters import Counts
from actors.bridges.ros2.errors import RosError
from actors.bridges.ros2.patient_publisher import (
    LINGER_SEC,
    MATCH_SEC,
    MAX_WAITING,
    MAX_WAITING_BYTES,
    PatientPublisher,
)

if TYPE_CHECKING:
    from collections.abc import Callable


class Timer:
    """A call that a loop will make."""

    def __init__(self) -> None:
        self.is_cancelled = False

    def cancel(self) -> None:
        """Do not make it."""
        self.is_cancelled = True


class World:
    """A loop whose time passes when the test says so, and a publisher of ROS 2."""

    def __init__(self) -> None:
        self.now = 100.0
        self.calls: list[tuple[float, Timer, Callable[..., None], tuple[Any, ...]]] = []
        self.sent: list[bytes] = []
        self.subscriptions = 0
        self.destroyed = 0
        self.counts = Counts()
        ours: Any = self
        self.publisher = PatientPublisher(ours, self.counts, ours)

    def time(self) -> float:
        """Return the loop's time."""
        return self.now

    def call_later(self, delay: float, callback: Callable[..., None], *arguments: Any) -> Timer:
        """Plan a call."""
        timer = Timer()
        self.calls.append((self.now + delay, timer, callback, arguments))
        return timer

    def publish(self, data: bytes) -> None:
        """Send a message in ROS 2."""
        if data == b"bad":
            raise RosError("it is bad")
        self.sent.append(data)

    def subscription_count(self) -> int:
        """Return what DDS has connected."""
        return self.subscriptions

    def destroy(self) -> None:
        """Destroy the publisher."""
        self.destroyed += 1

    def pass_time(self, seconds: float) -> None:
        """Let time pass, and make the calls that are due."""
        end = self.now + seconds
        while due := [each for each in self.calls if each[0] <= end]:
            call = min(due, key=lambda each: each[0])
            self.calls.remove(call)
            self.now = max(self.now, call[0])
            if not call[1].is_cancelled:
                call[2](*call[3])
        self.now = end


def test_messages_wait_until_somebody_hears_them() -> None:
    """In order; afterwards each leaves at once, whoever is connected."""
    world = World()
    for data in (b"1", b"2"):
        world.publisher.publish(data, 0)
    world.pass_time(0.1)
    assert not world.sent
    world.subscriptions = 1
    world.pass_time(0.1)
    assert world.sent == [b"1", b"2"]
    world.subscriptions = 0
    world.publisher.publish(b"3", 0)
    assert world.sent == [b"1", b"2", b"3"]


def test_a_publisher_that_is_connected_sends_at_once() -> None:
    """Without a look later."""
    world = World()
    world.subscriptions = 1
    world.publisher.publish(b"1", 0)
    assert (world.sent, world.calls) == ([b"1"], [])


def test_messages_wait_for_a_limited_time_and_number() -> None:
    """Case 92: what is too much is dropped and counted; the rest is sent though nobody seems to listen."""
    world = World()
    for _ in range(MAX_WAITING + 3):
        world.publisher.publish(b"x", 0)
    assert world.counts.dropped.total() == 3
    world.pass_time(MATCH_SEC + 0.1)
    assert len(world.sent) == MAX_WAITING


def test_a_single_message_of_any_size_waits() -> None:
    """A latched map is published once, when nobody is connected yet; what comes behind it has no space."""
    world = World()
    large = bytes(MAX_WAITING_BYTES + 1)
    world.publisher.publish(large, 0)
    world.publisher.publish(b"x", 0)
    world.subscriptions = 1
    world.pass_time(0.1)
    assert world.sent == [large]
    assert world.counts.dropped.total() == 1


def test_one_that_ros_2_refuses_does_not_stop_the_others() -> None:
    """It is counted; later it is an error of its own."""
    world = World()
    for data in (b"1", b"bad", b"2"):
        world.publisher.publish(data, 0)
    world.subscriptions = 1
    world.pass_time(0.1)
    assert world.sent == [b"1", b"2"]
    assert world.counts.dropped == Counter(refused=1)
    with pytest.raises(RosError):
        world.publisher.publish(b"bad", 0)


def test_it_stays_a_moment_after_it_has_sent() -> None:
    """A message that arrives meanwhile leaves, too; then it is gone, and says so."""
    world = World()
    left: list[bool] = []
    world.publisher.publish(b"1", 0)
    assert world.publisher.leave(lambda: left.append(True)) == LINGER_SEC
    world.publisher.publish(b"2", 0)
    world.subscriptions = 1
    world.pass_time(LINGER_SEC / 2)
    assert (world.sent, world.destroyed) == ([b"1", b"2"], 0)
    world.pass_time(LINGER_SEC)
    assert (left, world.destroyed) == ([True], 1)


def test_one_without_messages_on_their_way_goes_at_once() -> None:
    """It need not wait for anything."""
    world = World()
    world.pass_time(LINGER_SEC)
    assert world.publisher.leave(lambda: None) == 0
    assert world.destroyed == 1


def test_what_waits_at_the_end_is_counted() -> None:
    """Nobody was connected in time."""
    world = World()
    world.publisher.publish(b"1", 0)
    world.publisher.destroy()
    world.pass_time(MATCH_SEC)
    assert (world.sent, world.destroyed) == ([], 1)
    assert world.counts.dropped.total() == 1
