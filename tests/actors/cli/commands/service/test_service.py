"""`callboard service`: list, info, type, find, call."""

from __future__ import annotations

import logging
import sys
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import Trigger

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator
    from pathlib import Path

    from tests.actors.cli.conftest import Desk

ADD = ("service", "call", "/add_two_ints", "example_interfaces/srv/AddTwoInts")


def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
    """The sum; raises for a negative number."""
    if request.a < 0:
        raise ValueError("negative")
    response.sum = request.a + request.b
    return response


@asynccontextmanager
async def adder(desk: Desk) -> AsyncGenerator[None]:
    """A node that adds, and has a hidden service."""
    async with desk.node() as node:
        node.create_service(AddTwoInts, "add_two_ints", add)
        node.create_service(Trigger, "_secret", lambda request, response: response)
        await node.get_graph()
        yield


@pytest.mark.parametrize(
    ("options", "out"),
    [
        ([], "/add_two_ints\n"),
        (["-t"], "/add_two_ints [example_interfaces/srv/AddTwoInts]\n"),
        (["-c"], "1\n"),
        (["--include-hidden-services"], "/_secret\n/add_two_ints\n"),
        (["--json"], '[{"name": "/add_two_ints", "types": ["example_interfaces/srv/AddTwoInts"]}]\n'),
    ],
)
async def test_list(desk: Desk, options: list[str], out: str) -> None:
    """Sorted, one a line, hidden ones left out."""
    async with adder(desk):
        assert await desk.callboard("service", "list", *options) == (0, out, "")


async def test_info(desk: Desk) -> None:
    """Type, clients and servers, as ROS 2 prints them; the first slash may be left out."""
    async with adder(desk), desk.node("caller") as node:
        node.create_client(AddTwoInts, "add_two_ints")
        await node.get_graph()
        ended = await desk.callboard("service", "info", "add_two_ints")
    assert ended == (0, "Type: example_interfaces/srv/AddTwoInts\nClients count: 1\nServices count: 1\n", "")


async def test_verbose_info(desk: Desk) -> None:
    """Each client and server with its node."""
    async with adder(desk), desk.node("caller") as node:
        node.create_client(AddTwoInts, "add_two_ints")
        await node.get_graph()
        ended = await desk.callboard("service", "info", "-v", "/add_two_ints")
    blocks = ended.out.split("\n\n")
    assert blocks[:2] == ["Type: example_interfaces/srv/AddTwoInts", "Clients count: 1"]
    assert blocks[2].startswith("Node name: caller\nNode namespace: /\nService type: example_interfaces/srv/")
    assert "\nEndpoint type: CLIENT\n" in blocks[2]
    assert blocks[3] == "Services count: 1"
    assert blocks[4].startswith("Node name: fellow\n")
    assert "\nEndpoint type: SERVER\n" in blocks[4]


async def test_info_as_json(desk: Desk) -> None:
    """With every client and server."""
    async with adder(desk):
        document = (await desk.callboard("service", "info", "/add_two_ints", "--json")).json
    assert document["types"] == ["example_interfaces/srv/AddTwoInts"]
    assert document["clients"] == []
    assert [server["node"] for server in document["servers"]] == ["/fellow"]


async def test_info_names_those_that_are_not_connected(desk: Desk) -> None:
    """On stderr: the types of a client and a server differ."""
    async with adder(desk), desk.node("caller") as node:
        node.create_client(Trigger, "add_two_ints")
        await node.get_graph()
        ended = await desk.callboard("service", "info", "add_two_ints")
    assert ended.err == (
        "Not connected, as their types differ: /caller calls /add_two_ints as std_srvs/srv/Trigger, /fellow"
        " serves it as example_interfaces/srv/AddTwoInts\n"
    )


@pytest.mark.parametrize(
    ("arguments", "out"),
    [
        (["type", "/add_two_ints"], "example_interfaces/srv/AddTwoInts\n"),
        (["type", "_secret", "--include-hidden-services"], "std_srvs/srv/Trigger\n"),
        (["type", "/add_two_ints", "--json"], '["example_interfaces/srv/AddTwoInts"]\n'),
        (["find", "example_interfaces/srv/AddTwoInts"], "/add_two_ints\n"),
        (["find", "std_srvs/srv/Trigger"], ""),
        (["find", "std_srvs/srv/Trigger", "-c", "--include-hidden-services"], "1\n"),
        (["find", "example_interfaces/AddTwoInts", "--json"], '["/add_two_ints"]\n'),
    ],
)
async def test_type_and_find(desk: Desk, arguments: list[str], out: str) -> None:
    """From a name to its type, and from a type to its names."""
    async with adder(desk):
        assert await desk.callboard("service", *arguments) == (0, out, "")


@pytest.mark.parametrize("verb", ["info", "type"])
@pytest.mark.parametrize(
    ("name", "code", "text"),
    [
        ("/add_tw_ints", 1, "Unknown service '/add_tw_ints'; did you mean '/add_two_ints'?\n"),
        ("/qqqqqq", 1, "Unknown service '/qqqqqq'\n"),
        ("", 2, "service name must not be empty"),
    ],
)
async def test_unknown_services(desk: Desk, verb: str, name: str, code: int, text: str) -> None:
    """ROS 2's text, with what may have been meant."""
    async with adder(desk):
        ended = await desk.callboard("service", verb, name)
    assert (ended.code, ended.out) == (code, "")
    assert text in ended.err


async def test_call(desk: Desk) -> None:
    """ROS 2's texts."""
    async with adder(desk):
        ended = await desk.callboard(*ADD, "{a: 5, b: 3}")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == (
        "requester: making request: example_interfaces.srv.AddTwoInts_Request(a=5, b=3)\n\n"
        "response:\nexample_interfaces.srv.AddTwoInts_Response(sum=8)\n\n"
    )


async def test_call_as_json(desk: Desk) -> None:
    """The response alone."""
    async with adder(desk):
        assert (await desk.callboard(*ADD, "{a: 5, b: 3}", "--json")).json == {"sum": 8}


async def test_call_waits_for_the_service(desk: Desk) -> None:
    """It says so, and goes on when it comes."""
    call = desk.start(*ADD, "{a: 5, b: 3}")
    async with desk.node() as node:
        assert not await node.count_services("/add_two_ints")
        node.create_service(AddTwoInts, "add_two_ints", add)
        ended = await call
    assert ended.code == 0
    assert "AddTwoInts_Response(sum=8)" in ended.out


async def test_call_gives_up_waiting(desk: Desk) -> None:
    """--timeout: 124; a similar name is suggested."""
    async with adder(desk):
        ended = await desk.callboard(
            "service", "call", "/ad_two_ints", "example_interfaces/srv/AddTwoInts", "--timeout", "0.05"
        )
    assert ended.code == 124
    assert ended.out == "waiting for service to become available... did you mean '/add_two_ints'?\n"
    assert ended.err == (
        "Service '/ad_two_ints' has no server of type example_interfaces/srv/AddTwoInts after 0.05 s\n"
    )


async def test_call_of_a_handler_that_raises(desk: Desk) -> None:
    """The remote error's type and text, and 1."""
    async with adder(desk):
        ended = await desk.callboard(*ADD, "{a: -1}", "--json")
    assert (ended.code, ended.out) == (1, "")
    assert ended.err == "Service '/add_two_ints' failed: ValueError: negative\n"


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("/add_two_ints", "std_msgs/msg/String"), 1, "is not a service type"),
        (("/add_two_ints", "example_interfaces/srv/AddTwoInt"), 1, "example_interfaces/srv/AddTwoInts?"),
        (("/add_two_ints", "example_interfaces/srv/AddTwoInts", "{c: 1}"), 1, "no field 'c'"),
        (("add two", "example_interfaces/srv/AddTwoInts"), 2, "Invalid service name"),
    ],
)
async def test_bad_input_is_named(desk: Desk, arguments: tuple[str, ...], code: int, text: str) -> None:
    """No traceback, nothing on stdout."""
    ended = await desk.callboard("service", "call", *arguments)
    assert (ended.code, ended.out) == (code, "")
    assert text in ended.err


async def test_call_with_the_wrong_type_does_not_wait(desk: Desk, caplog: pytest.LogCaptureFixture) -> None:
    """What serves it is named; the command's own node is not, neither here nor at the server."""
    async with adder(desk):
        ended = await desk.callboard("service", "call", "/add_two_ints", "std_srvs/srv/Trigger")
    assert ended == (
        1,
        "",
        "'/add_two_ints' is served as example_interfaces/srv/AddTwoInts, not std_srvs/srv/Trigger\n",
    )
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


async def test_calls_from_stdin(desk: Desk, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A call for each document, the answers in order; the end of stdin ends it."""
    (tmp_path / "asked").write_text('{"a": 1, "b": 2}\na: 3\nb: 4\n---\n{a: 5}', encoding="utf-8")
    with (tmp_path / "asked").open(encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        async with adder(desk):
            ended = await desk.callboard(*ADD, "--stdin", "--json")
    assert (ended.code, ended.err) == (0, "")
    assert ended.documents == [{"sum": 3}, {"sum": 7}, {"sum": 5}]


async def test_call_takes_values_or_stdin(desk: Desk) -> None:
    """Not both."""
    ended = await desk.callboard(*ADD, "{a: 1}", "--stdin")
    assert (ended.code, ended.err) == (2, "Give VALUES or --stdin, not both\n")
