"""What belongs to the loop's thread refuses others, with the remedy, and has done nothing."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.actors.meeting import DEADLINE_SEC, MIB

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    import actors
    from tests.actors.meeting import Meeting


def of_publisher(action: Callable[[actors.Publisher[String]], Any]) -> Callable[[actors.Node], Any]:
    """Return what makes a publisher in the loop's thread, and the action for another one."""

    def prepare(node: actors.Node) -> Any:
        publisher = node.create_publisher(String, "chatter", 10)
        return lambda: action(publisher)

    return prepare


def of_timer(action: Callable[[actors.Timer], Any]) -> Callable[[actors.Node], Any]:
    """Return what makes a timer in the loop's thread, and the action for another one."""

    def prepare(node: actors.Node) -> Any:
        timer = node.create_timer(1000, print)
        return lambda: action(timer)

    return prepare


def of_client(action: Callable[[actors.Client[Any, Any]], Any]) -> Callable[[actors.Node], Any]:
    """Return what makes a client in the loop's thread, and the action for another one."""

    def prepare(node: actors.Node) -> Any:
        client = node.create_client(Trigger, "do")
        return lambda: action(client)

    return prepare


def answer(_: Trigger.Request) -> Trigger.Response:
    """Do nothing."""
    return Trigger.Response()


ACTIONS: dict[str, Callable[[actors.Node], Callable[[], Any]]] = {
    "publish": of_publisher(lambda publisher: publisher.publish(String(data="hello"))),
    "publish large": of_publisher(lambda publisher: publisher.publish(String(data="x" * MIB))),
    "publish encoded": of_publisher(lambda publisher: publisher.publish_encoded(b"\x81\xa4data\xa1x")),
    "destroy publisher": of_publisher(lambda publisher: publisher.destroy()),
    "assert liveliness": of_publisher(lambda publisher: publisher.assert_liveliness()),
    "create publisher": lambda node: lambda: node.create_publisher(String, "chatter", 1),
    "create subscription": lambda node: lambda: node.create_subscription(String, "chatter", print),
    "create service": lambda node: lambda: node.create_service(Trigger, "do", answer),
    "create client": lambda node: lambda: node.create_client(Trigger, "do"),
    "create timer": lambda node: lambda: node.create_timer(1, print),
    "cancel timer": of_timer(lambda timer: timer.cancel()),
    "reset timer": of_timer(lambda timer: timer.reset()),
    "destroy timer": of_timer(lambda timer: timer.destroy()),
    "call": of_client(lambda client: client.call_async(Trigger.Request())),
    "watch": lambda node: node.watch_graph,
    "destroy node": lambda node: node.destroy_node,
}


@pytest.mark.parametrize("action", ACTIONS)
async def test_another_thread_is_refused(meeting: Meeting, action: str) -> None:
    """At once, instead of a message that leaves with the next event of the loop; the node goes on."""
    node = await meeting.node("talker")
    act = ACTIONS[action](node)
    before = node.diagnostics()
    with pytest.raises(RuntimeError, match=r"belong to the thread that it runs in.*docs/how-to/threads"):
        await asyncio.to_thread(act)
    after = node.diagnostics()
    assert (after.publishers, len(after.subscriptions)) == (before.publishers, len(before.subscriptions))
    assert (await node.get_graph()).nodes() == ["/talker"]


async def test_waits_in_a_loop_of_another_thread_are_refused(meeting: Meeting) -> None:
    """Their futures would belong to a loop that nobody wakes."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", 10)
    waits: list[Callable[[], Coroutine[Any, Any, Any]]] = [
        publisher.flush,
        publisher.wait_for_subscriptions,
        node.get_graph,
    ]
    for wait in waits:
        with pytest.raises(RuntimeError, match="belong to the thread that it runs in"):
            await asyncio.to_thread(in_loop_of_its_own, wait)


def in_loop_of_its_own(wait: Callable[[], Coroutine[Any, Any, Any]]) -> None:
    """Run a coroutine function in this thread."""
    asyncio.run(wait())


async def test_the_remedies_work(meeting: Meeting) -> None:
    """Those that the error names: messages arrive at once."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", 10)
    messages = aiter((await meeting.node("listener")).create_subscription(String, "chatter"))
    await publisher.wait_for_subscriptions()
    loop = asyncio.get_running_loop()
    await asyncio.to_thread(loop.call_soon_threadsafe, publisher.publish, String(data="one"))
    async with asyncio.timeout(DEADLINE_SEC):
        assert (await anext(messages)).data == "one"

    async def publish() -> None:
        publisher.publish(String(data="two"))

    future = await asyncio.to_thread(asyncio.run_coroutine_threadsafe, publish(), loop)
    async with asyncio.timeout(DEADLINE_SEC):
        await asyncio.wrap_future(future)
        assert (await anext(messages)).data == "two"


async def test_before_and_after_its_run_a_node_is_anybodys(meeting: Meeting) -> None:
    """A thread may make a node for another one, and clear up when that has ended."""
    node = await asyncio.to_thread(meeting.absent, "talker")
    publisher = await asyncio.to_thread(node.create_publisher, String, "chatter", 10)
    await asyncio.to_thread(publisher.publish, String(data="early"))
    assert publisher.queued == 1
    async with node:
        pass
    await asyncio.to_thread(node.destroy_node)
    await asyncio.to_thread(publisher.destroy)
