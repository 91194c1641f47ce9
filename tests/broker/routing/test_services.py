"""Large calls travel alone, links count their pending answers, and suspended peers learn what has ended."""

from __future__ import annotations

import pytest

from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto import limits
from proto.wire import frames
from proto.wire.codes import Status
from proto.wire.frames import ReplyEntry, RequestEntry
from tests.broker import frame_makers as make
from tests.broker.switch import Switch

LARGE = bytes(limits.MAX_FRAME_BYTES + 1)


def pair(switch: Switch) -> tuple[int, int]:
    """Join an asker (client 1) and a server (service 1) of /s; nothing waits."""
    asker, server = switch.join("/asker"), switch.join("/server")
    switch.send(asker, make.client(1))
    switch.send(server, make.service(1))
    switch.read_all(asker)
    switch.read_all(server)
    return asker, server


def ask(*bodies: bytes) -> frames.Request:
    """Return requests of client 1 with these bodies in one frame; their call ids are 0, 1, 2 ..."""
    return frames.Request(1, tuple(RequestEntry(call, None, None, body) for call, body in enumerate(bodies)))


def bodies_of(read: list[frames.Request]) -> list[list[bytes]]:
    """Return what has been asked, frame by frame."""
    return [[entry.body for entry in frame.entries] for frame in read]


def test_a_large_call_is_cancelled_without_its_neighbours() -> None:
    """A client cancels one of three calls that came in one frame: the server gets the two others."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, ask(LARGE + b"a", LARGE + b"b", b"small"), frames.Cancel(1, (0,)))
    asked = [body for frame in bodies_of(switch.read(server, frames.Request)) for body in frame]
    assert sorted(asked) == [LARGE + b"b", b"small"]
    assert switch.router.calls.pending == 2


def test_small_calls_of_a_large_frame_stay_together() -> None:
    """Cutting up a frame does not make a frame of each call, and none of the frames is large."""
    switch = Switch()
    asker, server = pair(switch)
    bodies = [bytes([number]) * 10_000 for number in range(100)]
    switch.send(asker, ask(*bodies))
    asked = bodies_of(switch.read(server, frames.Request))
    assert [body for frame in asked for body in frame] == bodies
    assert len(asked) <= 10
    assert max(sum(map(len, frame)) for frame in asked) < limits.MAX_FRAME_BYTES


def test_large_answers_travel_alone() -> None:
    """A frame of answers is split in the same way; each of them arrives once."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, ask(b"1", b"2", b"3"))
    asked = [entry for frame in switch.read(server, frames.Request) for entry in frame.entries]
    bodies = [LARGE + b"a", b"small", LARGE + b"c"]
    answers = tuple(
        ReplyEntry(entry.call, 0, more=False, attributes=None, body=body)
        for entry, body in zip(asked, bodies, strict=True)
    )
    switch.send(server, frames.Reply(1, answers))
    read = switch.read(asker, frames.Reply)
    assert sorted(len(frame.entries) for frame in read) == [1, 1, 1]
    assert sorted((entry.call, entry.body) for frame in read for entry in frame.entries) == [
        *enumerate(bodies)
    ]


def test_a_call_that_is_too_large_does_not_cost_its_neighbours() -> None:
    """Beyond the message limit only the call itself, and only the answer itself, ends as unavailable."""
    switch = Switch(Router(limits=RouterLimits(max_message_bytes=1000)))
    asker, server = pair(switch)
    switch.send(asker, ask(b"first", bytes(2000), b"third"))
    ends = [entry for frame in switch.read(asker, frames.Reply) for entry in frame.entries]
    assert [(entry.call, entry.status) for entry in ends] == [(1, Status.UNAVAILABLE)]
    asked = [entry for frame in switch.read(server, frames.Request) for entry in frame.entries]
    assert [entry.body for entry in asked] == [b"first", b"third"]
    answers = tuple(
        ReplyEntry(entry.call, 0, more=False, attributes=None, body=bytes(size))
        for entry, size in zip(asked, (2000, 10), strict=True)
    )
    switch.send(server, frames.Reply(1, answers))
    ends = [entry for frame in switch.read(asker, frames.Reply) for entry in frame.entries]
    assert [(entry.call, entry.status) for entry in ends] == [(0, Status.UNAVAILABLE), (2, Status.OK)]
    assert switch.router.calls.pending == 0


@pytest.mark.parametrize("how", ["answer", "cancel", "undeclare", "suspend", "takeover", "leave", "asker"])
def test_a_link_knows_how_many_answers_it_owes(how: str) -> None:
    """However calls end, none stays pending; two services are added up."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(server, make.service(2, "/other"))
    switch.send(asker, make.client(2, "/other"), make.request(1, 5, 6), make.request(2, 7))
    owing = switch.router.peer(server)
    assert owing is not None
    assert owing.owed_calls == 3
    switch.send(server, frames.Retire(1))
    assert owing.owed_calls == 3
    match how:
        case "answer":
            for request in switch.read(server, frames.Request):
                calls = [entry.call for entry in request.entries]
                switch.send(
                    server, make.reply(request.endpoint, *calls), make.reply(request.endpoint, *calls)
                )
        case "cancel":
            switch.send(asker, frames.Cancel(1, (5, 6, 6)), frames.Cancel(2, (7,)))
        case "undeclare":
            switch.send(server, frames.Undeclare(1))
            assert owing.owed_calls == 1
            switch.send(server, frames.Undeclare(0))
        case "suspend":
            switch.suspend(server)
            switch.restore(server)
        case "takeover":
            switch.join(instance=owing.instance, token=owing.token)
        case "leave":
            switch.leave(server)
        case _:
            switch.leave(asker)
    assert owing.owed_calls == 0
    assert switch.router.calls.pending == 0


def test_a_suspended_client_learns_that_its_calls_have_ended() -> None:
    """When it is restored, it does not wait for answers that will not come; the server is informed."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 5, 6))
    calls = [entry.call for frame in switch.read(server, frames.Request) for entry in frame.entries]
    switch.suspend(asker)
    assert [frame.calls for frame in switch.read(server, frames.Cancel)] == [tuple(calls)]
    ends = [entry for frame in switch.read(asker, frames.Reply) for entry in frame.entries]
    assert [(entry.call, entry.status) for entry in ends] == [
        (5, Status.UNAVAILABLE),
        (6, Status.UNAVAILABLE),
    ]
    switch.restore(asker)
    switch.send(asker, make.request(1, 5))
    assert len(switch.read(server, frames.Request)) == 1
