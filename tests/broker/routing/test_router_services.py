"""Calls in the router: which server answers, who is informed of an end, and that no call is left pending."""

from __future__ import annotations

import pytest

from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codes import NoticeKind, Status
from tests.broker import frame_makers as make
from tests.broker.switch import Switch


def pair(switch: Switch) -> tuple[int, int]:
    """Join an asker (client 1) and a server (service 1) of /s; nothing waits."""
    asker, server = switch.join("/asker"), switch.join("/server")
    switch.send(asker, make.client(1))
    switch.send(server, make.service(1))
    switch.read_all(asker)
    switch.read_all(server)
    return asker, server


def calls_of(switch: Switch, server: int) -> list[int]:
    """Return the call ids that have reached a server since the last look."""
    return [entry.call for frame in switch.read(server, frames.Request) for entry in frame.entries]


def ends_of(switch: Switch, asker: int) -> list[tuple[int, int]]:
    """Return (call, status) of each end that an asker has heard of since the last look."""
    return [
        (entry.call, entry.status) for frame in switch.read(asker, frames.Reply) for entry in frame.entries
    ]


def test_a_call_goes_there_and_back_under_another_id() -> None:
    """The server sees the broker's id, the client its own; body and attributes pass."""
    switch = Switch()
    asker, server = pair(switch)
    entry = frames.RequestEntry(70, 1500, {"trace": "x"}, b"question")
    switch.send(asker, frames.Request(1, (entry,)))
    (request,) = switch.read(server, frames.Request)
    (asked,) = request.entries
    assert asked[1:] == (1500, {"trace": "x"}, b"question")
    answer = frames.ReplyEntry(asked.call, 0, more=False, attributes={"a": 1}, body=b"answer")
    switch.send(server, frames.Reply(1, (answer,)))
    (reply,) = switch.read(asker, frames.Reply)
    assert reply == frames.Reply(1, (answer._replace(call=70),))
    assert switch.router.calls.pending == 0


def test_calls_without_a_server_end_at_once() -> None:
    """Unavailable is said at once, to a refused client as well."""
    switch = Switch()
    asker = switch.join("/asker")
    switch.send(asker, make.client(1), make.request(1, 5, 6), make.request(99, 7))
    assert sorted(ends_of(switch, asker)) == [(call, Status.UNAVAILABLE) for call in (5, 6, 7)]


def test_servers_share_by_fewest_pending_and_ties_rotate() -> None:
    """Equal servers get equal shares; a busy one gets none until the others are as busy."""
    switch = Switch()
    asker = switch.join("/asker")
    servers = [switch.join(f"/server{n}") for n in range(3)]
    switch.send(asker, make.client(1))
    for server in servers:
        switch.send(server, make.service(1))
    switch.send(asker, make.request(1, *range(9)))
    shares = [calls_of(switch, server) for server in servers]
    assert [len(share) for share in shares] == [3, 3, 3]
    switch.send(servers[1], make.reply(1, *shares[1]))
    switch.send(asker, make.request(1, 20, 21, 22))
    assert [len(calls_of(switch, server)) for server in servers] == [0, 3, 0]


def test_servers_share_whether_they_come_before_or_after_a_client() -> None:
    """Pools exist only while there are clients; a later client finds the servers that are left."""
    switch = Switch()
    servers = [switch.join(f"/server{n}") for n in range(3)]
    asker = switch.join("/asker")
    switch.send(servers[0], make.service(1))
    switch.send(servers[1], make.service(1))
    switch.send(asker, make.client(1))
    switch.send(servers[2], make.service(1))
    switch.send(asker, make.request(1, *range(6)))
    assert [len(calls_of(switch, server)) for server in servers] == [2, 2, 2]
    switch.send(asker, frames.Undeclare(1))
    switch.send(servers[0], frames.Undeclare(1))
    switch.send(asker, make.client(2), make.request(2, *range(6)))
    assert [len(calls_of(switch, server)) for server in servers] == [0, 3, 3]
    assert switch.router.calls.pending == 6


def test_ties_rotate_when_every_call_is_answered_at_once() -> None:
    """A quick caller does not always meet the same server."""
    switch = Switch()
    asker = switch.join("/asker")
    servers = [switch.join(f"/server{n}") for n in range(3)]
    switch.send(asker, make.client(1))
    for server in servers:
        switch.send(server, make.service(1))
    met = [0, 0, 0]
    for call in range(30):
        switch.send(asker, make.request(1, call))
        for position, server in enumerate(servers):
            for number in calls_of(switch, server):
                met[position] += 1
                switch.send(server, make.reply(1, number))
    assert met == [10, 10, 10]


def test_another_type_is_no_match_and_is_reported() -> None:
    """Client and server of different types do not meet; both hear why."""
    switch = Switch()
    asker, server = switch.join("/asker"), switch.join("/server")
    switch.send(asker, make.client(1))
    switch.send(server, make.service(1, type_hash="RIHS01_bb"))
    assert [n.kind for n in switch.read(server, frames.Notice)] == [NoticeKind.INCOMPATIBLE_TYPE]
    assert [n.kind for n in switch.read(asker, frames.Notice)] == [NoticeKind.INCOMPATIBLE_TYPE]
    switch.send(asker, make.request(1, 5))
    assert ends_of(switch, asker) == [(5, Status.UNAVAILABLE)]


def test_many_servers_of_another_type_are_summed_up_for_a_client() -> None:
    """A newcomer gets 16 notices and a summary; each server gets its own notice."""
    switch = Switch()
    server, asker = switch.join("/server"), switch.join("/asker")
    switch.send(server, *(make.service(n, type_hash="RIHS01_bb") for n in range(1, 41)))
    switch.send(asker, make.client(1))
    assert [notice.peers for notice in switch.read(asker, frames.Notice)] == [1] * 16 + [24]
    assert [notice.id for notice in switch.read(server, frames.Notice)] == [*range(1, 41)]


def test_both_sides_learn_how_many_match() -> None:
    """MATCHED counts a client's servers and a server's clients."""
    switch = Switch()
    asker, server = switch.join("/asker"), switch.join("/server")
    switch.send(asker, make.client(1))
    switch.send(server, make.service(1))
    assert switch.read(asker, frames.Matched) == [frames.Matched(1, 1, 1)]
    assert switch.read(server, frames.Matched) == [frames.Matched(1, 1, 1)]
    switch.leave(server)
    assert switch.read(asker, frames.Matched) == [frames.Matched(1, 0, 1)]


@pytest.mark.parametrize("how", ["leave", "suspend", "undeclare"])
def test_a_server_that_goes_ends_its_calls(how: str) -> None:
    """Case 38: its callers hear at once if it dies, freezes or is undeclared; a late reply is ignored."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 5, 6))
    calls = calls_of(switch, server)
    match how:
        case "leave":
            switch.leave(server)
        case "suspend":
            switch.suspend(server)
        case _:
            switch.send(server, frames.Undeclare(1))
    assert ends_of(switch, asker) == [(5, Status.UNAVAILABLE), (6, Status.UNAVAILABLE)]
    if how != "leave":
        switch.send(server, make.reply(1, *calls))
        assert ends_of(switch, asker) == []
        assert switch.router.calls.late == 2


@pytest.mark.parametrize("how", ["leave", "undeclare"])
def test_a_client_that_goes_cancels_its_calls(how: str) -> None:
    """The server hears that nobody waits, and its late reply is counted and dropped."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 5, 6))
    calls = calls_of(switch, server)
    if how == "leave":
        switch.leave(asker)
    else:
        switch.send(asker, frames.Undeclare(1))
    cancelled = [call for frame in switch.read(server, frames.Cancel) for call in frame.calls]
    assert cancelled == calls
    switch.send(server, make.reply(1, *calls))
    assert switch.router.calls.late == 2
    assert switch.router.calls.pending == 0


def test_a_cancelled_call_is_over_for_the_broker() -> None:
    """CANCEL reaches the server once; its reply is dropped, and the id may be used again."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 5))
    (call,) = calls_of(switch, server)
    switch.send(asker, frames.Cancel(1, (5, 5, 77)))
    assert [frame.calls for frame in switch.read(server, frames.Cancel)] == [(call,)]
    switch.send(server, make.reply(1, call))
    assert ends_of(switch, asker) == []
    switch.send(asker, make.request(1, 5))
    assert len(calls_of(switch, server)) == 1


def test_many_cancellations_travel_together() -> None:
    """A client that goes with 10,000 calls costs each of two servers two frames, not 5,000."""
    switch = Switch()
    asker = switch.join("/asker")
    servers = [switch.join(f"/server{n}") for n in range(2)]
    switch.send(asker, make.client(1))
    for server in servers:
        switch.send(server, make.service(1))
    for start in range(0, 10_000, 1000):
        switch.send(asker, make.request(1, *range(start, start + 1000)))
    calls = [calls_of(switch, server) for server in servers]
    switch.leave(asker)
    for server, its_calls in zip(servers, calls, strict=True):
        cancels = switch.read(server, frames.Cancel)
        assert len(cancels) == 2
        assert [call for frame in cancels for call in frame.calls] == its_calls


def test_a_suspended_server_is_told_which_calls_are_over() -> None:
    """When it is restored it should not work for callers that have got an error."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 5, 6))
    calls = calls_of(switch, server)
    switch.suspend(server)
    assert [frame.calls for frame in switch.read(server, frames.Cancel)] == [tuple(calls)]
    assert ends_of(switch, asker) == [(5, Status.UNAVAILABLE), (6, Status.UNAVAILABLE)]


def test_a_large_unsent_request_is_removed_when_cancelled() -> None:
    """Cancelling in time spares the server the whole request."""
    switch = Switch()
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 5, body=bytes(2**20)), frames.Cancel(1, (5,)))
    assert calls_of(switch, server) == []


def test_nobody_answers_for_another_server() -> None:
    """Case 25: a reply with a stolen or guessed id, from another link or another service, is ignored."""
    switch = Switch()
    asker, server = pair(switch)
    thief = switch.join("/thief")
    switch.send(thief, make.service(1, "/other"), make.service(2))
    switch.send(server, make.service(2, "/other"))
    switch.read_all(server)
    switch.send(asker, make.request(1, 5))
    holders = {peer: calls_of(switch, peer) for peer in (server, thief)}
    (holder,) = [peer for peer, calls in holders.items() if calls]
    (call,) = holders[holder]
    other = thief if holder == server else server
    switch.send(other, make.reply(1, call), make.reply(2, call), make.reply(55, call))
    right = 1 if holder == server else 2
    switch.send(holder, make.reply(3 - right, call))
    assert ends_of(switch, asker) == []
    assert switch.router.calls.late == 4
    switch.send(holder, make.reply(right, call))
    assert ends_of(switch, asker) == [(5, Status.OK)]


def test_a_live_call_id_cannot_be_used_again() -> None:
    """Two pending calls with one id would be ambiguous: the link closes."""
    switch = Switch()
    asker, _ = pair(switch)
    switch.send(asker, make.request(1, 5))
    with pytest.raises(ProtocolError) as caught:
        switch.send(asker, make.request(1, 5))
    assert caught.value.code is ErrorCode.UNEXPECTED


def test_too_many_pending_calls_are_turned_away() -> None:
    """Case 28: calls beyond the limit end as overloaded; an answer frees a place."""
    switch = Switch(Router(limits=RouterLimits(max_pending_calls=2)))
    asker, server = pair(switch)
    switch.send(asker, make.request(1, 1, 2, 3))
    assert ends_of(switch, asker) == [(3, Status.OVERLOADED)]
    switch.send(server, make.reply(1, *calls_of(switch, server)))
    switch.read_all(asker)
    switch.send(asker, make.request(1, 4))
    assert len(calls_of(switch, server)) == 1


def test_unanswered_calls_vanish_with_their_asker() -> None:
    """Case 28: pending calls cost their own size, and all of them end when the asker goes."""
    switch = Switch()
    asker, server = pair(switch)
    for start in range(0, 20_000, 1000):
        switch.send(asker, make.request(1, *range(start, start + 1000)))
    assert switch.router.calls.pending == 20_000
    switch.leave(asker)
    assert switch.router.calls.pending == 0
    assert len({call for frame in switch.read(server, frames.Cancel) for call in frame.calls}) == 20_000


def test_a_retired_server_answers_what_it_has_and_gets_nothing_new() -> None:
    """RETIRE sends new requests elsewhere, or nowhere; replies to old ones are still taken."""
    switch = Switch()
    asker, old, new = switch.join("/asker"), switch.join("/old"), switch.join("/new")
    switch.send(asker, make.client(1))
    switch.send(old, make.service(1))
    switch.send(asker, make.request(1, 5))
    [request] = switch.read(old, frames.Request)
    switch.send(old, frames.Retire(1))
    assert switch.read(asker, frames.Matched)[-1].peers == 0
    switch.send(asker, make.request(1, 6))
    assert [entry.status for reply in switch.read(asker, frames.Reply) for entry in reply.entries] == [2]
    switch.send(new, make.service(1))
    switch.send(asker, make.request(1, 7))
    assert switch.read(old, frames.Request) == []
    assert len(switch.read(new, frames.Request)) == 1
    switch.send(old, make.reply(1, request.entries[0].call), frames.Retire(1), frames.Undeclare(1))
    answers = [entry for reply in switch.read(asker, frames.Reply) for entry in reply.entries]
    assert [(answer.call, answer.status) for answer in answers] == [(5, 0)]


@pytest.mark.parametrize("silent", [True, False])
def test_a_retired_server_that_goes_ends_its_calls(*, silent: bool) -> None:
    """Suspended or gone, what it has not answered is answered for it, and nothing of it is left."""
    switch = Switch()
    asker, old = switch.join("/asker"), switch.join("/old")
    switch.send(asker, make.client(1))
    switch.send(old, make.service(1))
    switch.send(asker, make.request(1, 5))
    switch.send(old, frames.Retire(1))
    switch.read_all(asker)
    if silent:
        switch.suspend(old)
        switch.restore(old)
    else:
        switch.leave(old)
    assert [entry.status for reply in switch.read(asker, frames.Reply) for entry in reply.entries] == [2]
    assert switch.router.calls.pending == 0
    switch.send(asker, make.request(1, 6))
    assert [entry.status for reply in switch.read(asker, frames.Reply) for entry in reply.entries] == [2]
