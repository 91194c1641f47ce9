"""Recorded requests of services, sent again."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.bags import BagTopic, Player, PlayerOptions, Recorder, Selection, Writer
from actors.bags.player.played_service import RequestsSource
from actors.bags.player.player import EVERYTHING
from actors.bags.player.service_requests import MAX_UNANSWERED
from actors.endpoints.service_introspection import EventKind
from actors.interfaces import cdr
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.service_event import service_event
from actors.interfaces.service_msgs.msg import ServiceEventInfo
from tests.actors.bags.bags import START_NS
from tests.actors.meeting import Meeting, until

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


EVENT: Any = service_event(AddTwoInts)
CONTENTS = actors.ServiceIntrospectionState.CONTENTS


class Doubles(actors.Service, type_name="lab_srvs/srv/Doubles"):
    """A service that a bag knows and this program forgets."""

    class Request(actors.Message):
        value: int = 0

    class Response(actors.Message):
        value: int = 0


def event(kind: EventKind, number: int | None) -> bytes:
    """Return an event with a request, or without contents."""
    request = [] if number is None else [AddTwoInts.Request(a=number)]
    return cdr.encode(EVENT(info=ServiceEventInfo(event_type=kind), request=request))


def events(path: Path, *kinds: EventKind, count: int = 1, contents: bool = True) -> Path:
    """Write a bag with events of calls of /add."""
    with Writer(path) as bag:
        topic = bag.add_topic(BagTopic.of_class("/add/_service_event", EVENT))
        for index in range(count):
            for kind in kinds:
                bag.write(topic, event(kind, index if contents else None), START_NS + index, START_NS)
    return path


def player(meeting: Meeting, path: Path, source: str = "service_introspection", **options: Any) -> Player:
    """Return a player that sends requests, each with a deadline of 30 s."""
    chosen = PlayerOptions(service_requests=RequestsSource(source), **options)
    return Player(path, EVERYTHING, chosen, url=meeting.url, default_call_timeout_sec=30)


async def server(meeting: Meeting, answer: Callable[[Any], Any], name: str = "/add") -> list[int]:
    """Return the list of requests that a new server has received."""
    seen: list[int] = []

    async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        seen.append(request.a)
        found = answer(request)
        reply: AddTwoInts.Response = await found if asyncio.iscoroutine(found) else found
        return reply

    node = await meeting.node("server")
    node.create_service(AddTwoInts, name, handle)
    await node.get_graph()
    return seen


def add(request: Any) -> Any:
    """Answer a request."""
    return AddTwoInts.Response(sum=request.a + request.b)


async def test_recorded_calls_are_made_again(meeting: Meeting, tmp_path: Path) -> None:
    """Each call once, although both ends published events of it; no event is published."""
    node = await meeting.node("caller")
    service = node.create_service(AddTwoInts, "/add", add)
    client = node.create_client(AddTwoInts, "/add")
    for end in (service, client):
        end.configure_introspection(node.get_clock(), actors.QoSProfile(depth=100), CONTENTS)
    async with Recorder(tmp_path / "trip", Selection(services=["/add"]), url=meeting.url) as recording:
        for index in range(3):
            await client.call(AddTwoInts.Request(a=index))
        await until(lambda: recording.statistics().written == 12)
    service.destroy()
    client.destroy()
    seen = await server(meeting, add)
    async with player(meeting, tmp_path / "trip", rate=1000) as playing:
        await playing.wait()
        found = playing.statistics()
    assert seen == [0, 1, 2]
    assert (found.published, found.answered, found.failed, found.unserved) == (3, 3, 0, 0)
    assert found.topics == {"/add/_service_event": 3}


@pytest.mark.parametrize(
    ("source", "kind"),
    [
        ("service_introspection", EventKind.REQUEST_RECEIVED),
        ("client_introspection", EventKind.REQUEST_SENT),
    ],
)
async def test_the_source_of_requests(meeting: Meeting, tmp_path: Path, source: str, kind: EventKind) -> None:
    """Events of servers or of clients; others are left out."""
    other = EventKind.REQUEST_SENT if kind is EventKind.REQUEST_RECEIVED else EventKind.REQUEST_RECEIVED
    seen = await server(meeting, add, "/sum")
    events(tmp_path / "trip", kind, EventKind.RESPONSE_SENT, count=2)
    events(tmp_path / "others", other, EventKind.RESPONSE_RECEIVED, count=2)
    for name in ("trip", "others"):
        async with player(meeting, tmp_path / name, source, remappings={"/add": "/sum"}) as playing:
            await playing.wait()
    assert seen == [0, 1]


async def test_no_server(meeting: Meeting, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Requests that no server could receive are counted, and a line says so."""
    events(tmp_path / "trip", EventKind.REQUEST_RECEIVED, count=3)
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        found = playing.statistics()
    assert (found.published, found.unserved) == (0, 3)
    assert any("'/add' has no server" in each.getMessage() for each in caplog.records)


async def test_requests_that_fail(meeting: Meeting, tmp_path: Path) -> None:
    """Errors of the server are counted, and so are requests without a reply within the node's deadline."""
    events(tmp_path / "trip", EventKind.REQUEST_RECEIVED, count=2)

    async def fail(request: Any) -> Any:
        if request.a == 0:
            raise ValueError("no")
        await asyncio.Event().wait()

    await server(meeting, fail)
    options = PlayerOptions(service_requests=RequestsSource.SERVICE)
    async with Player(
        tmp_path / "trip", options=options, url=meeting.url, default_call_timeout_sec=0.3
    ) as playing:
        await playing.wait()
        found = playing.statistics()
    assert (found.published, found.answered, found.failed) == (2, 0, 2)


async def test_events_without_contents(meeting: Meeting, tmp_path: Path) -> None:
    """Nobody knows these requests: they are invalid, with the reason in the log."""
    seen = await server(meeting, add)
    events(tmp_path / "trip", EventKind.REQUEST_RECEIVED, count=2, contents=False)
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        assert playing.statistics().invalid == 2
    assert seen == []


async def test_a_slow_service(meeting: Meeting, tmp_path: Path) -> None:
    """It gets a limited number of calls at once, and the others later; stopping ends the calls."""
    count = 3 * MAX_UNANSWERED
    events(tmp_path / "trip", EventKind.REQUEST_RECEIVED, count=count)
    free = asyncio.Event()

    async def wait(request: Any) -> Any:
        await free.wait()
        return add(request)

    seen = await server(meeting, wait)
    async with player(meeting, tmp_path / "trip") as playing:
        await until(lambda: playing.statistics().published == MAX_UNANSWERED)
        await meeting.settled(playing.node)
        assert playing.statistics().published == MAX_UNANSWERED
        free.set()
        await playing.wait()
        found = playing.statistics()
    assert seen == list(range(count))
    assert (found.published, found.answered) == (count, count)


async def test_a_type_that_is_not_installed(meeting: Meeting, tmp_path: Path) -> None:
    """The service is that of the definition in the bag."""
    made: Any = service_event(Doubles)
    topic = BagTopic.of_class("/double/_service_event", made)
    # As rosbag2 writes it: the text of the service.
    other = BagTopic("/double/_service_event", "lab_srvs/srv/Doubles_Event", topic.definition)
    data = cdr.encode(made(info=ServiceEventInfo(event_type=1), request=[Doubles.Request(value=7)]))
    with Writer(tmp_path / "trip") as bag:
        bag.write(bag.add_topic(other), data, START_NS, START_NS)
    seen: list[int] = []
    node = await meeting.node("server")

    def handle(request: Doubles.Request) -> Doubles.Response:
        seen.append(request.value)
        return Doubles.Response(value=2 * request.value)

    node.create_service(Doubles, "/double", handle)
    await node.get_graph()
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        assert playing.statistics().answered == 1
    assert seen == [7]


async def test_topics_that_are_no_service_events(meeting: Meeting, tmp_path: Path) -> None:
    """A topic whose definition has no request is named, and not played."""
    with Writer(tmp_path / "trip") as bag:
        definition = "int32 value\n"
        topic = bag.add_topic(BagTopic("/x/_service_event", "lab_srvs/srv/Big_Event", definition))
        bag.write(topic, b"\0\1\0\0\0\0\0\0", START_NS, START_NS)
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        (problem,) = playing.statistics().problems
    assert "'/x/_service_event' is not played" in problem
