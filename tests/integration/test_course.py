"""The programs of the course as processes: texts, exit codes, and every order of starting."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.integration.conftest import Program, System

TOPIC_PROGRAMS = ("broker", "minimal_publisher", "minimal_subscriber")
SERVICE_PROGRAMS = ("broker", "add_two_ints_server", "add_two_ints_client")
WAITING = "No broker at"


async def start_in_order(
    system: System, order: tuple[str, ...], *, arguments: tuple[str, ...] = ()
) -> dict[str, Program]:
    """Start programs one after the other, each when the previous one is ready or waits for a broker."""
    programs: dict[str, Program] = {}
    for name in order:
        if name == "broker":
            programs[name] = await system.broker()
            continue
        own = arguments if name.endswith("client") else ()
        programs[name] = await system.example(name, *own)
        if "broker" not in programs:
            await programs[name].wait_for_line(WAITING)
    return programs


async def test_publisher_and_subscriber_log_the_texts_of_the_course(system: System) -> None:
    """Both use ROS's log format and the node names of the course."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber")
    publisher = await system.example("minimal_publisher")
    said = await publisher.wait_for_line("Publishing")
    assert said.startswith("[INFO] [")
    assert said.endswith('[minimal_publisher]: Publishing: "Hi Automatic Addison: 0"')
    received = await subscriber.wait_for_line("I heard")
    assert '[minimal_subscriber]: I heard: "Hi Automatic Addison: ' in received


async def test_publishing_subscriber_republishes_what_it_receives(system: System) -> None:
    """Its text on the second topic has neither a colon nor quotes after "heard"."""
    await system.broker()
    relay = await system.example("publishing_subscriber")
    end = await system.example(
        "minimal_subscriber", "--ros-args", "-r", "addison:=addison2", "-r", "__node:=end"
    )
    await system.example("minimal_publisher")
    assert "[publishing_subscriber]: I heard Hi Automatic Addison: " in await relay.wait_for_line("I heard")
    assert '[end]: I heard: "I heard Hi Automatic Addison: ' in await end.wait_for_line("I heard")


async def test_server_and_client_log_the_texts_of_the_course(system: System) -> None:
    """Request and reply are logged on both sides, and the client exits with 0."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    await server.wait_for_line("[add_two_ints_server]: Ready to add two ints.")
    client = await system.example("add_two_ints_client", "5", "3")
    assert (await client.wait_for_line("Sum")).endswith("[add_two_ints_client]: Sum: 8")
    assert await client.wait_for_exit() == 0
    assert (await server.wait_for_line("Incoming request")).endswith(
        "[add_two_ints_server]: Incoming request"
    )
    assert await server.wait_for_line("a: ") == "a: 5 b: 3"
    assert (await server.wait_for_line("sending")).endswith(
        "[add_two_ints_server]: sending back response: [8]"
    )


async def test_client_takes_negative_numbers(system: System) -> None:
    """A negative number is not an option."""
    await system.broker()
    await system.example("add_two_ints_server")
    client = await system.example("add_two_ints_client", "-5", "3")
    await client.wait_for_line("Sum: -2")
    assert await client.wait_for_exit() == 0


@pytest.mark.parametrize("arguments", [(), ("5",), ("5", "3", "1"), ("five", "3")], ids=" ".join)
async def test_client_without_two_integers_prints_its_usage(
    system: System, arguments: tuple[str, ...]
) -> None:
    """It exits with 1, even without a broker."""
    client = await system.example("add_two_ints_client", *arguments)
    assert await client.wait_for_exit() == 1
    assert client.output == "usage: add_two_ints_client X Y"


async def test_client_reports_a_sum_that_does_not_fit(system: System) -> None:
    """A sum beyond int64 is an error at the client, and the server continues."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    client = await system.example("add_two_ints_client", str(2**63 - 1), "1")
    line = await client.wait_for_line("Failed to call service add_two_ints: ")
    assert str(2**63) in line
    assert await client.wait_for_exit() == 1
    assert "Traceback" not in client.output
    assert "Sum" not in client.output
    await server.wait_for_line("AddTwoInts_Response.sum")
    again = await system.example("add_two_ints_client", str(2**63 - 2), "1")
    await again.wait_for_line(f"Sum: {2**63 - 1}")


async def test_client_reports_an_operand_that_does_not_fit(system: System) -> None:
    """The client checks the request before it sends it."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    client = await system.example("add_two_ints_client", str(2**63), "1")
    await client.wait_for_line("Failed to call service add_two_ints: ")
    assert await client.wait_for_exit() == 1
    assert "Traceback" not in client.output
    assert "Incoming" not in server.output


async def test_client_says_that_it_waits_for_the_service(system: System) -> None:
    """Without a server it logs that every second, and continues when the server starts."""
    await system.broker()
    client = await system.example("add_two_ints_client", "5", "3")
    await client.wait_for_line("service not available, waiting again...")
    await system.example("add_two_ints_server")
    await client.wait_for_line("Sum: 8")
    assert await client.wait_for_exit() == 0


@pytest.mark.parametrize("order", list(permutations(TOPIC_PROGRAMS)), ids="-".join)
async def test_topic_programs_find_each_other_in_any_order(system: System, order: tuple[str, ...]) -> None:
    """Programs that start first wait for the others."""
    programs = await start_in_order(system, order)
    await programs["minimal_subscriber"].wait_for_line('I heard: "Hi Automatic Addison: ')


@pytest.mark.parametrize("order", list(permutations(SERVICE_PROGRAMS)), ids="-".join)
async def test_service_programs_find_each_other_in_any_order(system: System, order: tuple[str, ...]) -> None:
    """Programs that start first wait for the others; only the client ends by itself."""
    programs = await start_in_order(system, order, arguments=("5", "3"))
    await programs["add_two_ints_client"].wait_for_line("Sum: 8")
    assert await programs["add_two_ints_client"].wait_for_exit() == 0


async def test_waiting_programs_say_once_how_to_start_a_broker(system: System) -> None:
    """The line names URL and command; later attempts log nothing."""
    publisher = await system.example("minimal_publisher")
    line = await publisher.wait_for_line(WAITING)
    assert f"No broker at {system.url}" in line
    assert f"callboard broker --port {system.port}" in line
    for _ in range(3):
        await publisher.wait_for_line("Publishing")
    assert publisher.output.count(WAITING) == 1
