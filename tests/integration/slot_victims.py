"""A publisher, a reader or a broker that kills itself at one step of a slot's life in shared memory.

`python -m tests.integration.slot_victims STEP COUNT` runs the step's program, which dies the COUNT-th time.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from broker.__main__ import main as run_broker

if TYPE_CHECKING:
    from collections.abc import Callable

SIZE: Final = 100_000
BURST: Final = 3
"""Messages in one turn of the event loop: they share a slot."""


class Step(NamedTuple):
    """A moment in a program.

    Attributes:
        role: Which program it is.
        owner: The class or module whose function marks the moment, as `module` or `module:class`.
        function: The function.
        after: Whether the moment is after the call.
        often: Whether there are many such moments in a session.
    """

    role: Literal["publisher", "reader", "broker"]
    owner: str
    function: str
    after: bool = False
    often: bool = True


_ARENA: Final = "proto.aio.arena:Arena"
_NODE: Final = "actors.session.shared_memory:SharedMemory"
_LINK: Final = "broker.serving.shared_memory:LinkMemory"
_BROKER: Final = "broker.serving.shared_memory:SharedMemory"
_REFERENCES: Final = "proto.wire.references:References"
_CHANNEL: Final = "proto.aio.channel:Channel"

STEPS: Final = {
    "publisher: its arena is made": Step("publisher", _ARENA, "__init__", after=True, often=False),
    "publisher: its arena is announced": Step("publisher", _NODE, "_announce", after=True, often=False),
    "publisher: the broker has opened its arena": Step("publisher", _NODE, "mapped", often=False),
    "publisher: a slot is begun": Step("publisher", _ARENA, "_append"),
    "publisher: a slot is written": Step("publisher", _ARENA, "put", after=True),
    "publisher: a message is added to a slot": Step("publisher", _ARENA, "extend", after=True),
    "publisher: a slot is referred to": Step("publisher", _REFERENCES, "refer", after=True),
    "publisher: a reference is sent": Step("publisher", _CHANNEL, "flush", after=True),
    "publisher: a release arrives": Step("publisher", _NODE, "released"),
    "publisher: a slot is free again": Step("publisher", _NODE, "released", after=True),
    "reader: an arena is announced": Step("reader", _NODE, "arena_announced", often=False),
    "reader: an arena is opened": Step("reader", _NODE, "arena_announced", after=True, often=False),
    "reader: a reference arrives": Step("reader", _NODE, "receive"),
    "reader: a message is to be copied": Step("reader", "proto.aio.arena", "copy_payload"),
    "reader: a message is copied": Step("reader", _NODE, "receive", after=True),
    "reader: messages are to be released": Step("reader", _NODE, "_release"),
    "reader: messages are released": Step("reader", _NODE, "_release", after=True),
    "reader: a release is sent": Step("reader", _CHANNEL, "flush", after=True),
    "broker: a client has proved itself": Step("broker", _LINK, "prove", after=True, often=False),
    "broker: an arena is to be opened": Step("broker", _LINK, "open", often=False),
    "broker: an arena is opened": Step("broker", _LINK, "open", after=True, often=False),
    "broker: an arena is announced": Step("broker", _LINK, "_announce", after=True, often=False),
    "broker: a reader has opened an arena": Step("broker", _LINK, "opened", after=True, often=False),
    "broker: a reference arrives": Step("broker", _LINK, "batch"),
    "broker: a slot waits": Step("broker", _LINK, "batch", after=True),
    "broker: a reader is referred to a slot": Step("broker", _REFERENCES, "refer", after=True),
    "broker: a reference is sent": Step(
        "broker", "proto.aio.budgeted_channel:BudgetedChannel", "flush", after=True
    ),
    "broker: a reader releases slots": Step("broker", _LINK, "released"),
    "broker: a reader has released slots": Step("broker", _LINK, "released", after=True),
    "broker: a slot is released": Step("broker", _LINK, "_release", after=True),
    "broker: releases are to be sent": Step("broker", _LINK, "_send_released"),
    "broker: releases are sent": Step("broker", _LINK, "_send_released", after=True),
    "broker: a publisher has left": Step("broker", _BROKER, "forget", often=False),
    "broker: an arena is forgotten": Step("broker", _BROKER, "forget", after=True, often=False),
}
"""What happens to a slot and its arena, in order, by who does it."""


def die_at(step: Step, count: int) -> None:
    """Let this process kill itself when it reaches a step for the `count`-th time."""
    module, _, name = step.owner.partition(":")
    owner: Any = importlib.import_module(module)
    if name:
        owner = getattr(owner, name)
    original: Callable[..., object] = getattr(owner, step.function)
    left = count

    def die() -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def deadly(*args: Any, **options: Any) -> object:
        nonlocal left
        left -= 1
        if not left and not step.after:
            die()
        result = original(*args, **options)
        if not left:
            die()
        return result

    setattr(owner, step.function, deadly)


def content(number: int) -> bytes:
    """Return the content of a message: its number, and bytes that depend on it."""
    return number.to_bytes(8, "big") + bytes([number % 251]) * SIZE


def number_of(message: UInt8MultiArray) -> int:
    """Return the number of a message; fail if its content is not that of one message."""
    data = bytes(message.data)
    number = int.from_bytes(data[:8], "big")
    assert data == content(number), "parts of several messages"
    return number


class Talker(actors.Node):
    """Publishes as fast as the event loop turns."""

    def __init__(self) -> None:
        super().__init__("victim")
        self._number = 0
        self._publisher = self.create_publisher(UInt8MultiArray, "victims", 10)
        self.create_timer(0.001, self._publish)

    def _publish(self) -> None:
        for _ in range(BURST):
            self._publisher.publish(UInt8MultiArray(data=content(self._number)))
            self._number += 1


class Listener(actors.Node):
    """Takes what the survivor publishes."""

    def __init__(self) -> None:
        super().__init__("victim")
        self.create_subscription(UInt8MultiArray, "survivors", number_of, 10)


def main() -> None:
    """Run the program of a step."""
    name, count, *sys.argv[1:] = sys.argv[1:]
    step = STEPS[name]
    die_at(step, int(count))
    if step.role == "broker":
        sys.exit(run_broker())
    actors.run(Talker if step.role == "publisher" else Listener)


if __name__ == "__main__":
    main()
