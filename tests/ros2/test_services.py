"""Services cross in both directions."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.rcl_interfaces.msg import Log
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.graphs import endpoints_until
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair

CALLS = 40
"""More than a ROS server keeps: it would forget all but the last ten."""
YES = SetBool.Request(data=True)


def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    """Answer with what was asked."""
    response.success = request.data
    response.message = "from callboard"
    return response


async def test_a_service_of_ros_is_called_from_callboard(pair: Pair) -> None:
    """The request arrives as it was, and so does the response."""
    name = f"{pair.name}/there"
    service = await pair.there.service(name, SetBool, SetBool.Response(success=True, message="from ROS"))
    client = pair.here.create_client(SetBool, name)
    assert await client.wait_for_service()
    assert await client.call(YES) == SetBool.Response(success=True, message="from ROS")
    assert await service.requests(1) == [YES]


async def test_a_service_of_callboard_is_called_from_ros(pair: Pair) -> None:
    """The request arrives as it was, and so does the response."""
    name = f"{pair.name}/here"
    pair.here.create_service(SetBool, name, answer)
    client = await pair.there.client(name, SetBool)
    assert await client.call(YES) == SetBool.Response(success=True, message="from callboard")
    response = await client.call(SetBool.Request())
    assert response == SetBool.Response(success=False, message="from callboard")


async def test_a_busy_server_of_ros_forgets_no_call(pair: Pair) -> None:
    """It has at most ten requests at a time, and the others wait in the bridge."""
    name = f"{pair.name}/busy"
    service = await pair.there.service(name, Trigger, Trigger.Response(success=True), held=True)
    client = pair.here.create_client(Trigger, name)
    assert await client.wait_for_service()
    calls = [client.call_async(Trigger.Request()) for _ in range(CALLS)]
    await service.requests(1)
    await service.release()
    responses = await asyncio.gather(*calls)
    assert responses == [Trigger.Response(success=True)] * CALLS
    assert len(await service.requests(CALLS)) == CALLS


async def test_many_calls_of_ros_are_answered(pair: Pair) -> None:
    """Each gets the response to its own request."""
    name = f"{pair.name}/many"

    def own(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        return response

    pair.here.create_service(SetBool, name, own)
    client = await pair.there.client(name, SetBool)
    assert await client.is_ready()
    asked = [number % 3 == 0 for number in range(8)]  # a client of ROS keeps ten responses
    calls = await client.send(*[SetBool.Request(data=each) for each in asked])
    found = await client.responses(calls, len(asked))
    assert [found[place].success for place in range(len(asked))] == asked


async def test_a_slow_service_does_not_hold_up_another(pair: Pair) -> None:
    """Calls of one that does not answer wait, and those of others do not; both ways."""
    slow, fast = f"{pair.name}/slow", f"{pair.name}/fast"
    held = await pair.there.service(slow, Trigger, Trigger.Response(), held=True)
    await pair.there.service(fast, Trigger, Trigger.Response(success=True))
    clients = [pair.here.create_client(Trigger, name) for name in (slow, fast)]
    for each in clients:
        assert await each.wait_for_service()
    waiting = [clients[0].call_async(Trigger.Request()) for _ in range(CALLS)]
    await held.requests(1)
    assert (await clients[1].call(Trigger.Request())).success
    assert not any(each.done() for each in waiting)
    await held.release()
    await asyncio.gather(*waiting)


async def test_a_slow_handler_of_callboard_does_not_hold_up_another(pair: Pair) -> None:
    """A call of ROS that waits for its handler lets others pass."""
    released = asyncio.Event()

    async def wait(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        await released.wait()
        response.message = "late"
        return response

    slow, fast = f"{pair.name}/slow_here", f"{pair.name}/fast_here"
    pair.here.create_service(Trigger, slow, wait, concurrent=True)
    pair.here.create_service(SetBool, fast, answer)
    client = await pair.there.client(slow, Trigger)
    assert await client.is_ready()
    calls = await client.send(Trigger.Request())
    assert (await (await pair.there.client(fast, SetBool)).call(YES)).success
    assert await client.responses(calls, 1, 0.0) == {}
    released.set()
    assert await client.responses(calls, 1) == {0: Trigger.Response(message="late")}


async def test_a_call_fails_when_the_server_of_ros_leaves(pair: Pair) -> None:
    """At once, as unavailable; the next server of the name answers."""
    name = f"{pair.name}/leaving"
    service = await pair.there.service(name, Trigger, Trigger.Response(), held=True)
    client = pair.here.create_client(Trigger, name)
    assert await client.wait_for_service()
    call = client.call_async(Trigger.Request(), timeout_sec=None)
    await service.requests(1)
    await service.destroy()
    with pytest.raises(actors.ServiceUnavailable):
        await call
    await until(lambda: not client.service_is_ready())
    await pair.there.service(name, Trigger, Trigger.Response(success=True))
    assert await client.wait_for_service()
    assert (await client.call(Trigger.Request())).success


async def test_a_call_has_a_deadline(pair: Pair) -> None:
    """A server of ROS that does not answer lets the call of callboard time out, and answers later ones."""
    name = f"{pair.name}/silent"
    service = await pair.there.service(name, Trigger, Trigger.Response(success=True), held=True)
    client = pair.here.create_client(Trigger, name)
    assert await client.wait_for_service()
    with pytest.raises(actors.ServiceTimeout):
        await client.call(Trigger.Request(), timeout_sec=0.2)
    await service.requests(1)
    await service.release()
    assert (await client.call(Trigger.Request())).success


async def test_a_failing_handler_of_callboard_is_reported_in_ros(pair: Pair) -> None:
    """The caller gets no response, /rosout has a line with the service, and the next call is answered."""
    name = f"{pair.name}/failing"
    failures = ["no power"]

    def fail(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if failures:
            raise RuntimeError(failures.pop())
        response.success = True
        return response

    pair.here.create_service(Trigger, name, fail)
    rosout = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    lines = await pair.there.subscription("/rosout", Log, rosout)
    client = await pair.there.client(name, Trigger)
    assert await client.is_ready()
    calls = await client.send(Trigger.Request())
    for count in range(1, 1000):
        found = await lines.received(count)
        if any(name in each.msg and "no power" in each.msg for each in found):
            break
    assert await client.responses(calls, 1, 0.0) == {}
    assert (await client.call(Trigger.Request())).success


async def test_a_service_that_both_sides_serve_stays_on_its_side(pair: Pair) -> None:
    """Each call is answered once, by the server of the caller's own side."""
    name = f"{pair.name}/twice"
    pair.here.create_service(SetBool, name, answer)
    await pair.there.service(name, SetBool, SetBool.Response(success=True, message="from ROS"))
    assert (await (await pair.there.client(name, SetBool)).call(YES)).message == "from ROS"
    await endpoints_until(pair.here, "services", name, 1)
    client = pair.here.create_client(SetBool, name)
    assert await client.wait_for_service()
    assert (await client.call(YES)).message == "from callboard"


async def test_calls_within_ros_do_not_hide_a_response_for_callboard(pair: Pair) -> None:
    """A client of ROS gets the responses for all clients of a service: those for others come and go."""
    name = f"{pair.name}/busy_within"
    await pair.there.service(name, Trigger, Trigger.Response(success=True))
    client = pair.here.create_client(Trigger, name)
    assert await client.wait_for_service()
    assert (await client.call(Trigger.Request())).success
    other = await pair.there.client(name, Trigger)
    for _ in range(5):  # at a time as many as a server keeps
        calls = await other.send(*[Trigger.Request()] * 10)
        assert len(await other.responses(calls, 10)) == 10
    assert (await client.call(Trigger.Request())).success
