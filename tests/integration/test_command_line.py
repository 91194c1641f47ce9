"""ROS arguments on real command lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import actors
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from tests.integration.conftest import System

PARAMETER_NODE = """
import actors

class Reader(actors.Node):
    def __init__(self):
        super().__init__("reader")
        self.declare_parameter("speed", 1)
        print("speed is", self.get_parameter("speed").value)

actors.run(Reader)
"""


async def test_namespaces_and_remaps_lead_to_the_same_topic(system: System) -> None:
    """A publisher in /ns1 with addison:=other publishes on /ns1/other."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber", "--ros-args", "-r", "addison:=/ns1/other")
    publisher = await system.example(
        "minimal_publisher", "--ros-args", "-r", "__ns:=/ns1", "-r", "addison:=other"
    )
    await publisher.wait_for_line("[ns1.minimal_publisher]: Publishing")
    await subscriber.wait_for_line("I heard")


async def test_topics_in_different_namespaces_are_separate(system: System) -> None:
    """A publisher in /ns1 reaches the subscriber in /ns1, and not the one in /ns2."""
    await system.broker()
    apart = await system.example("minimal_subscriber", "--ros-args", "-r", "__ns:=/ns2")
    async with actors.Node("observer", url=system.url) as node:
        assert await node.wait_for_node("/ns2/minimal_subscriber", timeout_sec=DEADLINE_SEC)
    together = await system.example("minimal_subscriber", "--ros-args", "-r", "__ns:=/ns1")
    await system.example("minimal_publisher", "--ros-args", "-r", "__ns:=/ns1")
    for _ in range(2):
        await together.wait_for_line("I heard")
    assert await apart.stop() == 0
    assert apart.output == ""


async def test_services_are_remapped_on_both_sides(system: System) -> None:
    """Client and server use the new name; arguments may precede --ros-args and follow --."""
    await system.broker()
    await system.example("add_two_ints_server", "--ros-args", "-r", "add_two_ints:=/math/sum")
    client = await system.example(
        "add_two_ints_client", "5", "--ros-args", "-r", "add_two_ints:=sum", "-r", "__ns:=/math", "--", "3"
    )
    await client.wait_for_line("[math.add_two_ints_client]: Sum: 8")
    assert await client.wait_for_exit() == 0


async def test_parameters_come_from_the_command_line(system: System) -> None:
    """The option -p sets a declared parameter."""
    await system.broker()
    program = await system.python("-c", PARAMETER_NODE, "--ros-args", "-p", "speed:=42")
    assert await program.wait_for_line("speed is") == "speed is 42"
    assert await program.stop() == 0


async def test_bad_ros_arguments_are_reported_in_one_line(system: System) -> None:
    """The exit code is 2, and the message names the wrong argument, without a traceback."""
    program = await system.example("minimal_publisher", "--ros-args", "-r", "addison:=")
    assert await program.wait_for_exit() == 2
    assert "Failed to parse ROS arguments" in program.output
    assert "addison:=" in program.output
    assert "Traceback" not in program.output


async def test_a_bad_broker_url_is_reported_in_one_line(system: System) -> None:
    """The exit code is 1, and the message names the URL, without a traceback."""
    system.url = "nonsense://here"
    program = await system.example("minimal_publisher")
    assert await program.wait_for_exit() == 1
    assert len(program.lines) == 1
    assert "nonsense" in program.output


async def test_a_second_node_of_the_same_name_ends_with_a_clear_error(system: System) -> None:
    """It prints one line and exits with 1; the first node continues, and a renamed one can join."""
    await system.broker()
    first = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.wait_for_line("I heard")
    second = await system.example("minimal_publisher")
    assert await second.wait_for_exit() == 1
    assert len([line for line in second.lines if "Publishing" not in line]) == 1
    assert "/minimal_publisher" in second.output
    third = await system.example("minimal_publisher", "--ros-args", "-r", "__node:=another")
    await third.wait_for_line("[another]: Publishing")
    first.skip()
    await first.wait_for_line("Publishing")
    subscriber.skip()
    await subscriber.wait_for_line("I heard")


async def test_a_name_is_free_again_when_its_node_was_killed(system: System) -> None:
    """After SIGKILL another node can take the name at once."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber")
    first = await system.example("minimal_publisher")
    await subscriber.wait_for_line("I heard")
    await first.kill()
    second = await system.example("minimal_publisher")
    subscriber.skip()
    await subscriber.wait_for_line("I heard")
    assert second.process.returncode is None
