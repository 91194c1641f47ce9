"""Launches in tests: what waits find, how they end, and that nothing is left."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import sys
import textwrap
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import pytest

import actors
import actors.testing
from actors.errors import BrokerUnreachable
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.launch import (
    DeclareLaunchArgument,
    ExecuteProcess,
    LaunchConfiguration,
    LaunchDescription,
    LaunchError,
    LaunchFileError,
    LogInfo,
    Node,
    OnProcessExit,
    OpaqueFunction,
    RegisterEventHandler,
)
from actors.testing import LaunchWaitError, OutputLine, ProcessState
from tests.actors.meeting import DEADLINE_SEC

if TYPE_CHECKING:
    from pathlib import Path

    from actors.launch.description.action import Action
    from actors.testing import RunningLaunch
    from tests.actors.meeting import Meeting

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")

launch = partial(actors.testing.launch, timeout_sec=DEADLINE_SEC, stop_timeout_sec=DEADLINE_SEC)
"""Patient with a busy machine."""

LONG_SEC: Final = 1000.0
"""For waits that must end by something else: a test gets less."""

SLEEP: Final = "import os, time; print('up', os.getpid(), flush=True); time.sleep(1000)"


def python(code: str, name: str, **options: Any) -> ExecuteProcess:
    """Return an action that runs Python code."""
    return ExecuteProcess(cmd=[sys.executable, "-u", "-c", textwrap.dedent(code)], name=name, **options)


async def pid_of(running: RunningLaunch, name: str) -> int:
    """Wait until a sleeper is up; return its pid, as it has it itself."""
    line = await running.wait_for_output("up", process=name, timeout_sec=DEADLINE_SEC)
    return int(line.text.removeprefix("up "))


def gone(pid: int) -> bool:
    """Tell whether there is no such process, not even a zombie: whoever has started it has waited for it."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


async def test_lines_are_found_that_came_and_that_come() -> None:
    """By text and by pattern, of one process or of all; the first each time, or the first behind one."""
    counts = "import time\nfor i in range(1000): print('count', i); time.sleep(0.01)"
    async with launch([LogInfo(msg="begins"), python(counts, "a"), python(counts, "b")]) as running:
        first = await running.wait_for_output("count 3", process="b-2")
        assert first.process == "b-2"
        assert await running.wait_for_output("count 3", process="b") == first
        assert (await running.wait_for_output(re.compile(r"count \d$"), process="a")).text == "count 0"
        later = await running.wait_for_output("count", process="b", after=first)
        assert (later.text, later.number > first.number) == ("count 4", True)
        assert (await running.wait_for_output("begins")).process == "launch"
        assert running.output("b").startswith("count 0\ncount 1\ncount 2\ncount 3\n")
        assert "begins\n" in running.output()
        assert running.dropped_lines == 0


@pytest.mark.processes
async def test_the_graph_is_waited_for_and_the_test_can_join_it(tmp_path: Path) -> None:
    """What is waited for is there when the waits return; the service answers the test's own node."""
    script = tmp_path / "adder.py"
    script.write_text(
        textwrap.dedent("""
            import actors
            from actors.interfaces.example_interfaces.srv import AddTwoInts
            from actors.interfaces.std_msgs.msg import String

            class Adder(actors.Node):
                def __init__(self):
                    super().__init__("adder")
                    self.create_publisher(String, "sums", 10)
                    self.create_service(AddTwoInts, "add", self.on_add)

                def on_add(self, request, response):
                    response.sum = request.a + request.b
                    return response

            actors.run(Adder)
        """)
    )
    async with launch([Node(script=str(script), namespace="ns1")]) as running:
        await running.wait_for_service("/ns1/add")
        await running.wait_for_topic("ns1/sums")
        await running.wait_for_node("/ns1/adder")
        async with actors.Node("tester", url=running.url, domain=running.domain) as tester:
            client = tester.create_client(AddTwoInts, "/ns1/add")
            assert await client.wait_for_service(DEADLINE_SEC)
            assert (await client.call(AddTwoInts.Request(a=2, b=3))).sum == 5
    assert running.process("adder").exit_code == 0


async def test_exit_codes() -> None:
    """A program's own, also if it has ended before; a signal's as a negative number."""
    async with launch([python("exit(3)", "three"), python(SLEEP, "sleeper")]) as running:
        assert await running.wait_for_exit("three") == 3
        assert await running.wait_for_exit("three-1") == 3
        pid = await pid_of(running, "sleeper")
        assert running.process("sleeper").pid == pid
        await running.stop()
        assert await running.wait_for_exit("sleeper") == -signal.SIGINT
        assert [each.state for each in running.processes()] == [ProcessState.ENDED] * 2


async def test_waiting_for_a_process_that_has_died_ends_at_once() -> None:
    """The error says what was waited for, how the process ended, and what it wrote last."""
    dies = "for i in range(25): print('line', i)\nraise SystemExit('no map')"
    async with launch([python(dies, "mapper"), python(SLEEP, "sleeper")]) as running:
        with pytest.raises(LaunchWaitError) as caught:
            await running.wait_for_output("ready", process="mapper", timeout_sec=LONG_SEC)
        said = str(caught.value).splitlines()
        assert said[:2] == ["No line with 'ready' from mapper: it has ended", "Processes:"]
        assert "  mapper-1: ended, exit code 1" in said
        assert said[-21] == "Output, the last 20 lines:"
        assert said[-20:] == [f"  [mapper-1] line {i}" for i in range(6, 25)] + ["  [mapper-1] no map"]
        await pid_of(running, "sleeper")


async def test_the_output_of_a_node_in_this_process_is_captured(capsys: pytest.CaptureFixture[str]) -> None:
    """What it logs and prints is its output, once; what the test prints is not. It ends with 0."""

    class Talker(actors.Node):
        def __init__(self) -> None:
            super().__init__("talker")
            self.get_logger().info("logged")
            print("printed")  # noqa: T201

    talker = Node(node=Talker, name="talker", namespace="ns1")
    async with launch([talker]) as running, launch([talker]) as other:
        await running.wait_for_node("/ns1/talker")
        await other.wait_for_node("/ns1/talker")
        print("mine")  # noqa: T201
        await running.wait_for_output("logged", process="/ns1/talker")
        await running.wait_for_output("printed", process="talker-1")
    assert await running.wait_for_exit("talker") == 0
    assert (running.output().count("logged"), running.output().count("printed")) == (1, 1)
    assert capsys.readouterr().out == "mine\n"


async def test_a_wait_for_a_process_that_nobody_knows_says_so() -> None:
    """The error for a wrong name lists the right ones, at the time limit and at the end; "launch" is one."""
    async with launch([python(SLEEP, "sleeper")]) as running:
        await pid_of(running, "sleeper")
        hint = "; no process is called 'slepper'; there is: sleeper-1\n"
        with pytest.raises(LaunchWaitError, match=f"No line with 'x' from slepper in 0.01 s{hint}"):
            await running.wait_for_output("x", process="slepper", timeout_sec=0.01)
        with pytest.raises(LaunchWaitError, match=f"No end of slepper in 0.01 s{hint}"):
            await running.wait_for_exit("slepper", timeout_sec=0.01)
        with pytest.raises(LaunchWaitError, match=r"No line with 'x' from launch in 0.01 s\n"):
            await running.wait_for_output("x", process="launch", timeout_sec=0.01)
        await running.stop()
        with pytest.raises(LaunchWaitError, match=f"the launch has ended{hint}"):
            await running.wait_for_output("x", process="slepper")


async def test_a_wait_ends_in_time() -> None:
    """The error says what runs, and is an AssertionError and a CallboardError."""
    async with launch([python(SLEEP, "sleeper")]) as running:
        pid = await pid_of(running, "sleeper")
        for wait, what in (
            (running.wait_for_output(re.compile("re+ady"), timeout_sec=0.01), "No line with 're+ady'"),
            (running.wait_for_exit("sleeper", timeout_sec=0.01), "No end of sleeper"),
            (running.wait_for_node("/a", timeout_sec=0.01), "No node /a"),
            (running.wait_for_topic("/a/b", timeout_sec=0.01), "No topic /a/b"),
            (running.wait_for_service("add", timeout_sec=0.01), "No service /add"),
            (running.wait_for_end(timeout_sec=0.01), "No end of the launch"),
            (running.wait_until(lambda: False, timeout_sec=0.01), "The condition did not become true"),
        ):
            with pytest.raises(AssertionError) as caught:
                await wait
            assert isinstance(caught.value, actors.CallboardError)
            assert str(caught.value).splitlines() == [
                f"{what} in 0.01 s",
                "Processes:",
                f"  sleeper-1: running, pid {pid}",
                "Output:",
                f"  [sleeper-1] up {pid}",
            ]


async def test_a_launch_that_has_ended_ends_all_waits() -> None:
    """What has not come by then never will; what has come is still found."""
    async with launch([python("print('bye')", "short")]) as running:
        waits = (
            running.wait_for_output("never", timeout_sec=LONG_SEC),
            running.wait_for_node("/never", timeout_sec=LONG_SEC),
            running.wait_for_exit("other", timeout_sec=LONG_SEC),
            running.wait_until(lambda: False, timeout_sec=LONG_SEC),
        )
        failures = await asyncio.gather(*waits, return_exceptions=True)
        assert all(isinstance(each, LaunchWaitError) for each in failures)
        assert all(": the launch has ended" in str(each) for each in failures)
        assert await running.wait_for_output("bye") == OutputLine("short-1", "bye", 1)
        assert await running.wait_for_exit("short") == 0
        assert await running.wait_for_end()


async def test_the_end_of_a_launch_says_whether_it_was_good() -> None:
    """A required process that dies is the end of it, and no good one."""
    required = python("exit(1)", "required", required=True)
    async with launch([python(SLEEP, "sleeper"), required]) as running:
        assert not await running.wait_for_end()


async def test_restarts_can_be_waited_for() -> None:
    """A process that is started again has not ended; how often that was is known."""
    async with launch([python("exit(1)", "dies", respawn=True, respawn_max_retries=2)]) as running:
        await running.wait_until(lambda: running.processes() and running.process("dies").restarts == 2)
        assert await running.wait_for_exit("dies") == 1
        assert running.process("dies").restarts == 2


async def test_names_that_mean_nobody_or_two() -> None:
    """Output is of all that have the name; an end is of one."""
    async with launch([python(SLEEP, "twin"), python(SLEEP, "twin")]) as running:
        pids = {await pid_of(running, "twin-1"), await pid_of(running, "twin-2")}
        assert {int(each) for each in re.findall(r"\d+", running.output("twin"))} == pids
        with pytest.raises(
            LaunchWaitError, match="No end of twin: more than one process has that name: twin-1, twin-2"
        ):
            await running.wait_for_exit("twin")
        with pytest.raises(LookupError, match="More than one process is called 'twin': twin-1, twin-2"):
            running.process("twin")
        with pytest.raises(LookupError, match="No process is called 'twn'; there is: twin-1, twin-2"):
            running.process("twn")


async def test_nothing_is_left_when_the_test_fails() -> None:
    """What the body raises comes out, and the processes have ended then."""
    pids: list[int] = []

    async def body() -> None:
        async with launch([python(SLEEP, "sleeper")]) as running:
            pids.append(await pid_of(running, "sleeper"))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        await body()
    assert gone(pids[0])


async def test_nothing_is_left_when_the_test_is_cancelled() -> None:
    """Also one that is deaf to SIGINT and SIGTERM, when whoever cancels is impatient."""
    deaf = "import signal\nfor number in 2, 15: signal.signal(number, signal.SIG_IGN)\n" + SLEEP
    pids: asyncio.Queue[int] = asyncio.Queue()

    async def body() -> None:
        async with launch([python(deaf, "deaf")], stop_timeout_sec=0.2) as running:
            pids.put_nowait(await pid_of(running, "deaf"))
            await asyncio.sleep(LONG_SEC)

    before = asyncio.all_tasks()
    task = asyncio.create_task(body())
    pid = await pids.get()
    task.cancel()
    await asyncio.sleep(0)
    task.cancel()
    await asyncio.wait({task})
    assert task.cancelled()
    assert gone(pid)
    assert asyncio.all_tasks() == before


async def test_a_wrong_description_is_an_error_on_entry(tmp_path: Path) -> None:
    """Nothing has been started then; the broker is gone again."""
    before = asyncio.all_tasks()
    wrong: list[tuple[Any, type[LaunchError]]] = [
        ([Node(script="missing.py")], LaunchError),
        (tmp_path / "missing.launch.py", LaunchFileError),
        (["no action"], LaunchError),
    ]
    for description, error in wrong:
        with pytest.raises(error):
            async with launch(description):
                pytest.fail("it was entered")
    assert asyncio.all_tasks() == before


async def test_what_turns_out_to_be_wrong_later_ends_waits_and_comes_out() -> None:
    """A function that fails in an event handler is the launch's failure, whatever the test waits for."""

    def fails(context: object) -> list[Action]:
        raise LaunchError("no such robot")

    async def body() -> None:
        async with launch([handler, python("", "short"), python(SLEEP, "sleeper")]) as running:
            with pytest.raises(LaunchWaitError, match=r"the launch has failed: .*no such robot"):
                await running.wait_for_node("/never", timeout_sec=LONG_SEC)
            with pytest.raises(LaunchError, match="no such robot"):
                await running.wait_for_end()

    handler = RegisterEventHandler(OnProcessExit(on_exit=[OpaqueFunction(function=fails)]))
    with pytest.raises(LaunchError, match="no such robot"):
        await body()


async def test_the_tests_own_error_names_the_launchs() -> None:
    """An error in the body of a test names the launch's error, which may be its cause."""

    def fails(context: object) -> list[Action]:
        raise LaunchError("no such robot")

    async def body() -> None:
        async with launch([handler, python("", "short")]) as running:
            await running.wait_until(lambda: "no such robot" in running.output("launch"))
            raise ZeroDivisionError

    handler = RegisterEventHandler(OnProcessExit(on_exit=[OpaqueFunction(function=fails)]))
    with pytest.raises(ZeroDivisionError) as caught:
        await body()
    assert any("no such robot" in note for note in caught.value.__notes__)


async def test_a_file_with_arguments_and_an_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its programs get the test's additions and where the broker is, but nothing else of callboard's."""
    monkeypatch.setenv("CALLBOARD_LOG_LEVEL", "DEBUG")
    monkeypatch.setenv("CALLBOARD_URL", "callboard://127.0.0.1:1")
    (tmp_path / "tell.py").write_text(
        "import os, sys\n"
        "print(sys.argv[1:], {k: v for k, v in os.environ.items() if k[:5] in ('CALLB', 'ROBOT')})"
    )
    path = tmp_path / "file.launch.py"
    path.write_text(
        textwrap.dedent("""
            from actors.launch import DeclareLaunchArgument, LaunchConfiguration, LaunchDescription, Node

            def generate_launch_description():
                return LaunchDescription([
                    DeclareLaunchArgument("speed", default_value="1"),
                    Node(script="tell.py", arguments=[LaunchConfiguration("speed")]),
                ])
        """)
    )
    async with launch(str(path), arguments={"speed": "7"}, environment={"ROBOT": "r2"}, domain=5) as running:
        line = await running.wait_for_output("['7'", process="tell")
    told = {"CALLBOARD_URL": running.url, "CALLBOARD_DOMAIN": "5", "ROBOT": "r2"}
    assert eval(line.text.partition("] ")[2]) == told
    assert running.url != "callboard://127.0.0.1:1"


async def test_a_description_is_seen_from_a_folder(tmp_path: Path) -> None:
    """Relative paths in a description that is no file are seen from there."""
    (tmp_path / "tell.py").write_text("print('told')")
    description = LaunchDescription(
        [DeclareLaunchArgument("what", default_value="tell.py"), Node(script=LaunchConfiguration("what"))]
    )
    async with launch(description, folder=tmp_path) as running:
        assert (await running.wait_for_output("told")).process == "tell-1"


async def test_launches_have_brokers_of_their_own() -> None:
    """Two side by side do not see each other."""
    async with launch([python(SLEEP, "a")]) as one, launch([python(SLEEP, "b")]) as other:
        assert one.url != other.url
        await asyncio.gather(pid_of(one, "a"), pid_of(other, "b"))
        assert [each.label for each in other.processes()] == ["b-1"]


async def test_the_tests_own_broker_can_be_used(meeting: Meeting) -> None:
    """With a URL the launch goes there: its nodes and the test's see each other."""
    async with launch([python(SLEEP, "a")], url=meeting.url) as running:
        assert running.url == meeting.url
        await meeting.node("mine")
        await running.wait_for_node("/mine")


async def test_without_the_broker_that_was_named_the_launch_fails() -> None:
    """A launch that can bring none of its own at that place says so on leaving."""
    urls = "callboard://127.0.0.1:1,callboard://127.0.0.1:2"

    async def body() -> None:
        async with launch([python(SLEEP, "a")], url=urls) as running:
            with pytest.raises(LaunchWaitError, match="the launch has failed: No broker at"):
                await running.wait_for_output("up", timeout_sec=LONG_SEC)

    with pytest.raises(BrokerUnreachable):
        await body()


async def test_a_flood_is_kept_in_part_and_searched_whole() -> None:
    """A line in the midst of very many is found though it is not kept; what is dropped is counted."""
    flood = """
        import os
        line = b"x" * 99 + b"\\n"
        for i in range(100): os.write(1, line * 200)
        print("needle")
        for i in range(100): os.write(1, line * 200)
        print("flooded")
    """
    async with launch([python(flood, "flood")]) as running:
        needle, end = await asyncio.gather(
            running.wait_for_output("needle"), running.wait_for_output("flooded")
        )
        assert (needle.number, end.number) == (20_001, 40_002)
        assert running.dropped_lines == 40_002 - 10_000
        assert running.output("flood").endswith("x\nflooded\n")
        assert running.output().count("\n") == 10_000


async def test_a_condition_that_raises_is_not_the_waits_limit() -> None:
    """What a condition raises comes out as it is, also a TimeoutError."""

    def slow() -> bool:
        raise TimeoutError("mine")

    async with launch([python(SLEEP, "a")]) as running:
        wait = running.wait_until(slow)
        with pytest.raises(TimeoutError, match="mine"):
            await wait
