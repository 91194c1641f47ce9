"""Replies that wait for the messages that their server has published before them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.codec import codec_for
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from tests.actors.meeting import DEADLINE_SEC, matched
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    import actors
    from tests.actors.meeting import Meeting

COUNT = 5
REQUEST = codec_for(AddTwoInts.Request).encode(AddTwoInts.Request())
RESPONSE = codec_for(AddTwoInts.Response).encode(AddTwoInts.Response(sum=7))


class Ends:
    """A raw service that publishes before it replies, and a raw client whose node runs another callback."""

    def __init__(self, meeting: Meeting, server: actors.Node, caller: actors.Node) -> None:
        self.meeting, self.server, self.caller = meeting, server, caller
        self.taken: list[int] = []
        self.gate = asyncio.Event()
        self.publisher = server.create_publisher(Int64, "numbers", 10)
        service = server.create_service(AddTwoInts, "add", self._serve, raw=True)
        service.reply_after(self.publisher)
        self.subscription = caller.create_subscription(Int64, "numbers", self._take, 10, raw=True)
        self.client: Any = caller.create_client(AddTwoInts, "add", raw=True)

    def _serve(self, request: bytes) -> bytes:
        for number in range(COUNT):
            self.publisher.publish(Int64(data=number))
        return RESPONSE

    def _take(self, data: bytes) -> None:
        self.taken.append(codec_for(Int64).decode(data).data)

    async def call(self) -> asyncio.Future[bytes]:
        """Call while the node of the client is busy, and return the reply once it has arrived."""
        await matched(self.publisher)
        assert await self.client.wait_for_service(DEADLINE_SEC)
        entered = asyncio.Event()

        async def hold() -> None:
            timer.cancel()
            entered.set()
            await self.gate.wait()

        timer = self.caller.create_timer(0, hold)
        await entered.wait()
        reply: asyncio.Future[bytes] = self.client.call_async(REQUEST)
        await self.meeting.settled(self.server, self.caller)
        assert self.client.pending == 0
        return reply


@pytest.fixture
async def ends(meeting: Meeting) -> Ends:
    return Ends(meeting, await meeting.node("server"), await meeting.node("caller"))


async def test_a_reply_waits_until_the_messages_before_it_are_handed_over(
    ends: Ends, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The subscription has got them, but its callback waits for another one."""
    set_limits(monkeypatch, feedback_wait_sec=DEADLINE_SEC)
    ends.client.receive_after(ends.subscription)
    reply = await ends.call()
    assert not reply.done()
    assert not ends.taken
    ends.gate.set()
    assert await reply == RESPONSE
    assert ends.taken == list(range(COUNT))


async def test_other_clients_do_not_wait(ends: Ends) -> None:
    """They may not even subscribe to the topic."""
    assert await (await ends.call()) == RESPONSE
    assert not ends.taken
    ends.gate.set()


async def test_a_reply_waits_for_a_limited_time(ends: Ends, monkeypatch: pytest.MonkeyPatch) -> None:
    """A callback may never end."""
    set_limits(monkeypatch, feedback_wait_sec=0)
    ends.client.receive_after(ends.subscription)
    assert await (await ends.call()) == RESPONSE
    assert not ends.taken
    ends.gate.set()


async def test_a_client_that_is_destroyed_gets_what_has_arrived(
    ends: Ends, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The call has been answered."""
    set_limits(monkeypatch, feedback_wait_sec=DEADLINE_SEC)
    ends.client.receive_after(ends.subscription)
    reply = await ends.call()
    ends.client.destroy()
    assert await reply == RESPONSE
    ends.gate.set()


async def test_a_cancelled_call_waits_for_nothing(ends: Ends, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its reply has arrived, but its caller has not got it."""
    set_limits(monkeypatch, feedback_wait_sec=DEADLINE_SEC)
    ends.client.receive_after(ends.subscription)
    reply = await ends.call()
    reply.cancel()
    ends.gate.set()
    assert await ends.client.call(REQUEST) == RESPONSE
    assert reply.cancelled()


async def test_only_a_callback_tells_what_has_been_handed_over(ends: Ends) -> None:
    """A subscription that is iterated over cannot hold replies back."""
    subscription = ends.caller.create_subscription(Int64, "numbers")
    with pytest.raises(TypeError, match="needs a subscription with a callback"):
        ends.client.receive_after(subscription)
