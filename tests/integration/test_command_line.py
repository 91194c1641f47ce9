"""ROS arguments on real command lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

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


async def test_namespaces_and_remaps_meet_on_the_same_topic(system: System) -> None:
    """A publisher in /ns1 with addison:=other is heard on /ns1/other."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber", "--ros-args", "-r", "addison:=/ns1/other")
    publisher = await system.example(
        "minimal_publisher", "--ros-args", "-r", "__ns:=/ns1", "-r", "addison:=other"
    )
    await publisher.says("[ns1.minimal_publisher]: Publishing")
    await subscriber.says("I heard")


async def test_topics_in_different_namespaces_do_not_meet(system: System) -> None:
    """A subscriber in /ns1 hears nothing from the root, and everything from /ns1."""
    await system.broker()
    apart = await system.example("minimal_subscriber", "--ros-args", "-r", "__ns:=/ns2")
    together = await system.example("minimal_subscriber", "--ros-args", "-r", "__ns:=/ns1")
    await system.example("minimal_publisher", "--ros-args", "-r", "__ns:=/ns1")
    for _ in range(2):
        await together.says("I heard")
    assert await apart.stop() == 0
    assert apart.output == ""


async def test_services_are_remapped_on_both_sides(system: System) -> None:
    """Client and server meet under the new name; numbers may stand before --ros-args and after --."""
    await system.broker()
    await system.example("add_two_ints_server", "--ros-args", "-r", "add_two_ints:=/math/sum")
    client = await system.example(
        "add_two_ints_client", "5", "--ros-args", "-r", "add_two_ints:=sum", "-r", "__ns:=/math", "--", "3"
    )
    await client.says("[math.add_two_ints_client]: Sum: 8")
    assert await client.ends() == 0


async def test_parameters_come_from_the_command_line(system: System) -> None:
    """-p sets a declared parameter."""
    await system.broker()
    program = await system.python("-c", PARAMETER_NODE, "--ros-args", "-p", "speed:=42")
    assert await program.says("speed is") == "speed is 42"
    assert await program.stop() == 0


async def test_bad_ros_arguments_are_reported_in_one_line(system: System) -> None:
    """Exit code 2, the offending text, no traceback."""
    program = await system.example("minimal_publisher", "--ros-args", "-r", "addison:=")
    assert await program.ends() == 2
    assert "Failed to parse ROS arguments" in program.output
    assert "addison:=" in program.output
    assert "Traceback" not in program.output


async def test_a_bad_broker_url_is_reported_in_one_line(system: System) -> None:
    """Exit code 1 and the URL, no traceback."""
    system.url = "nonsense://here"
    program = await system.example("minimal_publisher")
    assert await program.ends() == 1
    assert len(program.lines) == 1
    assert "nonsense" in program.output


async def test_a_second_node_of_the_same_name_ends_with_a_clear_error(system: System) -> None:
    """One line and exit code 1; the first node lives on, and a renamed one is welcome."""
    await system.broker()
    first = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.says("I heard")
    second = await system.example("minimal_publisher")
    assert await second.ends() == 1
    assert len([line for line in second.lines if "Publishing" not in line]) == 1
    assert "/minimal_publisher" in second.output
    third = await system.example("minimal_publisher", "--ros-args", "-r", "__node:=another")
    await third.says("[another]: Publishing")
    first.skip()
    await first.says("Publishing")
    subscriber.skip()
    await subscriber.says("I heard")


async def test_a_name_is_free_again_when_its_node_was_killed(system: System) -> None:
    """SIGKILL frees the name at once."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber")
    first = await system.example("minimal_publisher")
    await subscriber.says("I heard")
    await first.kill()
    second = await system.example("minimal_publisher")
    subscriber.skip()
    await subscriber.says("I heard")
    assert second.process.returncode is None
