"""Hearing topics for a command."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.callbacks.budget import CallbackBudget
from actors.cli import subscriber
from actors.interfaces.std_msgs.msg import Int32

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk


@pytest.mark.parametrize("slow", [True, False])
async def test_the_loop_turns_between_slow_messages(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, slow: bool
) -> None:
    """Whatever takes long with a message lets others have a turn; quick messages go on in a row."""
    monkeypatch.setattr(subscriber, "SLOW_SEC", -1.0 if slow else 1e9)
    loop, order = asyncio.get_running_loop(), list[str]()
    CallbackBudget.of(loop).clock = lambda: 0.0  # it has a limit for callbacks in a row, too
    async with desk.node() as node:
        publisher = node.create_publisher(Int32, "said", 10)
        with subscriber.Listener(node) as listener:

            def take(message: Int32, info: actors.MessageInfo) -> None:
                order.append("message")
                loop.call_soon(order.append, "turn")
                if message.data == 2:
                    listener.enough()

            listener.subscribe("said", take, actors.QoSProfile(depth=10), msg_type=Int32)
            await desk.matched(publisher)
            for number in range(3):
                publisher.publish(Int32(data=number))
            await listener.wait()
    assert order[:4] == (["message", "turn"] * 2 if slow else [*["message"] * 3, "turn"])
