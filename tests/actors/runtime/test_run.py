"""`actors.run`: results, failures, exit codes and signals."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import threading
import traceback
from typing import TYPE_CHECKING, Any, cast

import msgspec
import pytest

import actors
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import SimulatedClock
from broker import Broker, BrokerOptions
from tests.actors.meeting import DEADLINE_SEC

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator
    from pathlib import Path


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    """`actors.run` sets up the process's logging; put it back."""
    log = logging.getLogger("callboard")
    level = log.level
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    yield
    log.setLevel(level)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers


def lonely(tmp_path: Path, name: str = "n", **options: Any) -> actors.Node:
    """Return a node that never finds a broker."""
    return actors.Node(name, url=f"callboard+unix://{tmp_path}/none", **options)


def test_the_result_of_a_coroutine_function_is_returned() -> None:
    """One coroutine function: its result."""

    async def main() -> int:
        return 42

    assert actors.run(main, args=[]) == 42


def test_programs_run_side_by_side(tmp_path: Path) -> None:
    """Nodes, factories and coroutine functions run together until all have ended."""
    met: set[str] = set()
    both = asyncio.Barrier(3)

    class Member(actors.Node):
        def __init__(self, name: str) -> None:
            super().__init__(name, url=f"callboard+unix://{tmp_path}/none")
            self.create_timer(0, self.meet)

        async def meet(self) -> None:
            await both.wait()
            met.add(self.get_name())
            self.destroy_node()

    async def main() -> str:
        await both.wait()
        met.add("main")
        return "not returned, there are several"

    assert actors.run(Member("a"), lambda: Member("b"), main, args=[]) is None
    assert met == {"a", "b", "main"}


def test_arguments_reach_the_nodes(tmp_path: Path) -> None:
    """What stands behind --ros-args renames nodes that are made in the run, and those only."""
    names: list[str] = []

    async def main() -> None:
        names.append(lonely(tmp_path).get_name())
        names.append(lonely(tmp_path, use_global_arguments=False).get_name())

    actors.run(main, args=["--ros-args", "-r", "__node:=m"])
    names.append(lonely(tmp_path).get_name())
    assert names == ["m", "n", "n"]


def test_bad_arguments_exit_2(capsys: pytest.CaptureFixture[str]) -> None:
    """Arguments that cannot be read: one line on stderr, exit code 2, nothing runs."""

    async def main() -> None:
        pytest.fail("it must not run")

    with pytest.raises(SystemExit) as caught:
        actors.run(main, args=["--ros-args", "-r", "nonsense"])
    assert caught.value.code == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_a_log_level_that_is_none_exits_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wrong CALLBOARD_LOG_LEVEL: one line on stderr that says what may stand there, exit code 2."""

    async def main() -> None:
        pytest.fail("it must not run")

    monkeypatch.setenv("CALLBOARD_LOG_LEVEL", "loud")
    with pytest.raises(SystemExit) as caught:
        actors.run(main, args=[])
    assert caught.value.code == 2
    assert capsys.readouterr().err.startswith("CALLBOARD_LOG_LEVEL must be one of DEBUG")


@pytest.mark.parametrize("several", [False, True])
def test_errors_with_a_remedy_elsewhere_exit_1_with_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, *, several: bool
) -> None:
    """No broker ends everything: a line in the log, no traceback, exit code 1."""

    async def for_ever() -> None:
        await asyncio.Event().wait()

    others = (for_ever, lonely(tmp_path, "other")) if several else ()
    with pytest.raises(SystemExit) as caught:
        actors.run(lonely(tmp_path, connect_timeout_sec=0), *others, args=[])
    assert caught.value.code == 1
    fatal = [record for record in caplog.records if record.levelno >= logging.CRITICAL]
    assert len(fatal) == 1
    assert "No broker at" in fatal[0].getMessage()
    assert fatal[0].exc_info is None


async def publish_wrongly(node: actors.Node) -> None:
    """Set a field to a value of another type."""
    node.create_publisher(String, "chatter", 1).publish(String(data=cast("Any", 3)))


async def name_wrongly(node: actors.Node) -> None:
    """Use a name that is none."""
    node.create_publisher(String, "two words", 1)


async def read_undeclared(node: actors.Node) -> None:
    """Read a parameter that does not exist."""
    node.get_parameter("speed")


async def use_destroyed(node: actors.Node) -> None:
    """Publish after the publisher's end."""
    publisher = node.create_publisher(String, "chatter", 1)
    publisher.destroy()
    publisher.publish(String())


async def call_what_fails(node: actors.Node) -> None:
    """Call a service whose handler raises."""

    def divide(_: Trigger.Request) -> Trigger.Response:
        raise ZeroDivisionError("by zero")

    node.create_service(Trigger, "do", divide)
    await node.create_client(Trigger, "do").call(Trigger.Request())


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize(
    ("mistake", "text"),
    [
        (publish_wrongly, "std_msgs/msg/String.data: Expected str, got int"),
        (name_wrongly, "Invalid topic name"),
        (read_undeclared, "undeclared parameter(s): speed"),
        (use_destroyed, "This publisher has been destroyed"),
        (call_what_fails, "Service '/do' failed: ZeroDivisionError: by zero"),
    ],
)
def test_mistakes_of_the_program_have_a_traceback(
    caplog: pytest.LogCaptureFixture,
    mistake: Callable[[actors.Node], Awaitable[None]],
    text: str,
    *,
    several: bool,
) -> None:
    """It begins with the program's own line, and ends with the error."""

    async def main() -> None:
        async with Broker(BrokerOptions(port=0)) as broker, actors.Node("n", url=broker.url) as node:
            await mistake(node)

    async def for_ever() -> None:
        await asyncio.Event().wait()

    with pytest.raises(SystemExit) as caught:
        actors.run(main, *([for_ever] if several else []), args=[])
    assert caught.value.code == 1
    (fatal,) = (record for record in caplog.records if record.levelno >= logging.CRITICAL)
    assert text in fatal.getMessage()
    assert fatal.exc_info is not None
    lines = [frame.name for frame in traceback.extract_tb(fatal.exc_info[2])]
    assert lines[:2] == ["main", mistake.__name__]


@pytest.mark.parametrize("several", [False, True])
def test_other_errors_come_through(*, several: bool) -> None:
    """What is not callboard's is raised as it is, without a group around it."""

    async def main() -> None:
        raise ZeroDivisionError

    async def for_ever() -> None:
        await asyncio.Event().wait()

    with pytest.raises(ZeroDivisionError):
        actors.run(main, *([for_ever] if several else []), args=[])


def test_an_exit_in_a_program_is_its_own() -> None:
    """sys.exit(7) in a program ends the process with 7."""

    async def main() -> None:
        sys.exit(7)

    with pytest.raises(SystemExit) as caught:
        actors.run(main, args=[])
    assert caught.value.code == 7


@pytest.mark.parametrize("kind", ["def", "async def"])
def test_an_exit_in_a_callback_ends_the_run(tmp_path: Path, kind: str) -> None:
    """sys.exit(7) in a callback of either kind ends the process with 7."""

    def plain() -> None:
        sys.exit(7)

    async def slow() -> None:
        sys.exit(7)

    def make() -> actors.Node:
        node = lonely(tmp_path)
        node.create_timer(0.01, plain if kind == "def" else slow)
        return node

    with pytest.raises(SystemExit) as caught:
        actors.run(make, args=[])
    assert caught.value.code == 7


@pytest.mark.parametrize("kind", ["message", "jump"])
def test_an_exit_in_a_callback_for_received_data_ends_the_run(kind: str) -> None:
    """A plain callback runs where data is received; uvloop ignores what is raised there."""

    def leave(_: object) -> None:
        sys.exit(7)

    async def main() -> None:
        async with (
            Broker(BrokerOptions(port=0)) as broker,
            actors.Node("driver", url=broker.url) as driver,
            actors.Node("n", url=broker.url, parameter_overrides={"use_sim_time": True}) as node,
        ):
            if kind == "jump":
                forward = actors.JumpThreshold(
                    min_forward=actors.Duration(nanoseconds=1), min_backward=None, on_clock_change=False
                )
                node.get_clock().create_jump_callback(forward, post_callback=leave)
            else:
                node.create_subscription(Clock, "/clock", leave)
            await SimulatedClock(driver, node).set(1)
            await asyncio.Event().wait()

    async def limited() -> None:
        async with asyncio.timeout(DEADLINE_SEC):
            await main()

    with pytest.raises(SystemExit) as caught:
        actors.run(limited, args=[])
    assert caught.value.code == 7


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("several", [False, True])
def test_signals_end_a_run_cleanly(tmp_path: Path, number: signal.Signals, *, several: bool) -> None:
    """SIGINT and SIGTERM: programs are cancelled, may clean up, and `run` returns None."""
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("signals go to the main thread")
    cleaned: list[str] = []

    async def main() -> None:
        os.kill(os.getpid(), number)
        try:
            await asyncio.Event().wait()
        finally:
            cleaned.append("yes")

    others = (lonely(tmp_path, "other"),) if several else ()
    assert actors.run(main, *others, args=[]) is None
    assert cleaned == ["yes"]


def test_what_is_no_program_is_refused() -> None:
    """Something that gives neither a node nor an awaitable is a TypeError that says so."""
    with pytest.raises(TypeError, match="expected a node, a supervisor or"):
        actors.run(lambda: 5, args=[])  # type: ignore[arg-type]


async def test_a_loop_that_runs_already_is_reported_and_what_to_do() -> None:
    """In a coroutine or a notebook; the process is left as it was."""
    with pytest.raises(RuntimeError, match=r"`async with node:` or `await node\.run\(\)`"):
        actors.run(actors.Node)  # type: ignore[arg-type] # pyright: ignore[reportArgumentType]


def test_a_coroutine_instead_of_its_function_is_refused(recwarn: pytest.WarningsRecorder) -> None:
    """The error says what to pass, and Python does not complain about the coroutine besides."""

    async def main() -> None: ...

    with pytest.raises(TypeError, match=r"pass main without calling it, not main\(\)"):
        actors.run(cast("Any", main()), args=[])
    assert not recwarn.list
    with pytest.raises(TypeError, match="functions that return one, not 3"):
        actors.run(main, cast("Any", 3), args=[])


class Forgetful(actors.Node):
    """Does not make the node before it uses it."""

    def __init__(self) -> None:  # the mistake
        self.create_timer(1, print)


class Empty(actors.LifecycleNode):
    """Does not make the node at all."""

    def __init__(self) -> None:  # the mistake
        self.rate = 3


@pytest.mark.parametrize("program", [Forgetful, Empty])
def test_a_node_that_is_not_made_says_what_is_missing(program: type[actors.Node]) -> None:
    """Whichever of its methods is used first."""
    missing = rf"{program.__name__}.__init__ has to call super\(\).__init__\(node_name\)"
    with pytest.raises(AttributeError, match=missing):
        actors.run(program, args=[])


def test_an_attribute_that_a_node_does_not_have_is_an_ordinary_error(tmp_path: Path) -> None:
    """With Python's text, and a suggestion."""
    with pytest.raises(AttributeError, match=r"'Node' object has no attribute 'create_publsher'$"):
        _ = cast("Any", lonely(tmp_path)).create_publsher


class Broken(actors.Node):
    """Has a property that fails."""

    @property
    def speed(self) -> object:
        """Uses an attribute that there is not."""
        return cast("Any", self).sped


def test_a_property_of_a_node_fails_with_its_own_error() -> None:
    """Not with the claim that the node has no such property."""
    with pytest.raises(AttributeError, match=r"'Broken' object has no attribute 'sped'$"):
        _ = Broken("broken", start_parameter_services=False).speed


def make_with_a_mistyped_field() -> String:
    """Make a message, over several lines."""
    return String(
        dta="hello",  # type: ignore[call-arg]
    )


def make_a_request_with_an_unknown_field() -> Any:
    """Make a message whose class is an attribute."""
    return Trigger.Request(why="because")


@pytest.mark.parametrize(
    ("make", "note"),
    [
        (
            make_with_a_mistyped_field,
            "std_msgs/msg/String has no field 'dta'; did you mean 'data'? it has: data",
        ),
        (
            make_a_request_with_an_unknown_field,
            "std_srvs/srv/Trigger_Request has no field 'why'; it has none",
        ),
    ],
)
def test_an_unknown_field_is_named_with_those_that_there_are(make: Callable[[], Any], note: str) -> None:
    """msgspec's error has neither the type nor its fields."""

    async def main() -> None:
        make()

    with pytest.raises(TypeError, match="Unexpected keyword argument") as caught:
        actors.run(main, args=[])
    assert caught.value.__notes__ == [note]


def test_a_keyword_that_no_message_has_got_is_an_ordinary_error() -> None:
    """The hint is about messages only."""

    class Other(msgspec.Struct):
        data: str = ""

    async def main() -> None:
        Other(dta="x")  # type: ignore[call-arg]

    with pytest.raises(TypeError, match="Unexpected keyword argument") as caught:
        actors.run(main, args=[])
    assert not hasattr(caught.value, "__notes__")
