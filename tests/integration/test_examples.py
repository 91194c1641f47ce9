"""The examples beyond the course, executed unchanged."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.launch.planning.plan import make_plan
from actors.launch.resources.files import Files
from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from tests.integration.conftest import System

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.py"))


async def test_embedded_needs_nothing_else(system: System) -> None:
    """Broker, topic and service run in one process, without a daemon."""
    program = await system.example("embedded")
    assert await program.wait_for_exit() == 0
    assert program.lines == ["heard: hello from the same program", "5 + 3 = 8"]


async def test_a_driver_publishes_from_its_thread(system: System) -> None:
    """The main thread receives everything, and calls a service, without asyncio."""
    await system.broker()
    program = await system.example("driver_thread")
    assert await program.wait_for_exit() == 0
    assert program.lines == ["ticks: 1000, 1000 published, 0 dropped", "1000 + 1 = 1001"]


async def test_load_balanced_service_shows_an_even_split(system: System) -> None:
    """Three servers answer ten of thirty requests each."""
    await system.broker()
    program = await system.example("load_balanced_service")
    assert await program.wait_for_exit() == 0
    assert program.lines == [f"worker_{i} answered 10 of 30 requests" for i in range(3)]


async def test_parameters_are_set_and_watched(system: System) -> None:
    """A range and a callback refuse values, and the change arrives, before or after its result."""
    await system.broker()
    program = await system.example("parameters")
    no_step = "The parameter value for target is not close enough to a valid step."
    no_step += " Min: 5.0, max: 30.0, value: 21.3, step: 0.5"
    assert await program.wait_for_exit() == 0
    assert sorted(program.lines) == [
        "away True is set",
        "away is True now",
        "target 18.0 is refused: nobody is at home",
        f"target 21.3 is refused: {no_step}",
        "target 21.5 is set",
        "target: 20.0",
    ]


async def test_lifecycle_shows_each_step(system: System) -> None:
    """Another node brings it up and down; an exception in a callback leads through `on_error`."""
    await system.broker()
    program = await system.example("lifecycle")
    assert await program.wait_for_exit() == 0
    expected = [
        "unconfigured: opening the device",
        "configure succeeded",
        "activate succeeded",
        "heard: hello",
        "deactivate succeeded",
        "inactive: closing the device after an error",
        "cleanup failed",
        "unconfigured -> configuring",
        "configuring -> inactive",
        "inactive -> activating",
        "activating -> active",
        "active -> deactivating",
        "deactivating -> inactive",
        "inactive -> cleaningup",
        "cleaningup -> errorprocessing",
        "errorprocessing -> unconfigured",
    ]
    assert [line for line in program.lines if line in expected] == expected  # the others are the traceback


async def test_simulated_time_passes_and_is_repeated(system: System) -> None:
    """Sleeps, the rate and the timer follow it, forward and back; an hour takes no hour."""
    await system.broker()
    program = await system.example("simulated_time")
    assert await program.wait_for_exit() == 0
    assert program.lines == [
        *(hour := ["10:00 is warm", "30:00 is still warm", "50:00 is still warm"]),
        (back := "00:00 time was set back by 3600 s"),
        *hour,
        back,
        "120 checks",
    ]


async def test_latched_value_reaches_the_late_joiner(system: System) -> None:
    """It receives only the last value."""
    await system.broker()
    program = await system.example("latched_value")
    assert await program.wait_for_exit() == 0
    assert program.lines[-1] == "the late joiner got: attic"
    assert program.output.count("late joiner") == 1


async def test_a_fibonacci_goal_gives_feedback_and_a_result(system: System) -> None:
    """The client prints each step and the result; Ctrl-C in a second client cancels its goal."""
    await system.broker()
    server = await system.example("fibonacci_action_server")
    client = await system.example("fibonacci_action_client", "2")
    assert await client.wait_for_exit() == 0
    assert client.lines == ["feedback: 0 1 1", "feedback: 0 1 1 2", "SUCCEEDED: 0 1 1 2"]
    other = await system.example("fibonacci_action_client", "45")
    await other.wait_for_line("feedback: 0 1 1")
    await other.stop()
    await server.wait_for_line("Canceling a goal")
    assert await server.stop() == 0


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("action_one_at_a_time", ["first: ABORTED", "second: SUCCEEDED"]),
        (
            "action_queue",
            ["SUCCEEDED 1", "SUCCEEDED 2", "SUCCEEDED 3"],
        ),
    ],
)
async def test_action_servers_decide_when_goals_run(system: System, name: str, lines: list[str]) -> None:
    """A new goal aborts the one before it; or goals are executed one after the other."""
    await system.broker()
    program = await system.example(name)
    assert await program.wait_for_exit() == 0
    assert [line for line in program.lines if line in lines] == lines


async def test_supervised_counts_three_times(system: System) -> None:
    """The failing node is restarted twice, then given up; the events report it."""
    program = await system.example("supervised")
    assert await program.wait_for_exit() == 0
    assert program.lines.count("heard: 1") == 3
    assert "gave up: 'counter' died too often, last: RuntimeError: nothing left to count" in program.output
    assert program.lines[-1] == "counter given up RuntimeError: nothing left to count"
    assert program.lines.count("counter started") == 3


async def test_decorated_course_runs_all_five(system: System) -> None:
    """Messages are received and republished, and requests answered, in one process."""
    await system.broker()
    program = await system.example("course_decorated")
    relayed = await system.example(
        "minimal_subscriber", "--ros-args", "-r", "addison:=addison2", "-r", "__node:=end"
    )
    await program.wait_for_line('[minimal_subscriber]: I heard: "Hi Automatic Addison: ')
    await program.wait_for_line("[add_two_ints_client]: Sum: 8")
    await relayed.wait_for_line('I heard: "I heard Hi Automatic Addison: ')
    assert await program.stop() == 0
    assert "Traceback" not in program.output
    for text in ("Ready to add two ints.", "a: 5 b: 3", "sending back response: [8]"):
        assert text in program.output


@pytest.mark.parametrize("language", ["py", "yaml", "toml"])
async def test_course_launches_from_any_language(language: str, system: System) -> None:
    """All five programs work together with the launch's own broker, and stop together."""
    file = f"examples/launch/course.launch.{language}"
    program = await system.python("-m", "actors", "launch", file, "b:=4")
    for text in (
        "[minimal_publisher-1] [INFO]",
        '[course.minimal_subscriber]: I heard: "Hi Automatic Addison: ',
        "[course.echo]: I heard Hi Automatic Addison: ",
        "[course.add_two_ints_client]: Sum: 9",
        # Otherwise the client may be ending while it is interrupted, and Python says where.
        "[add_two_ints_client-5]: process has finished cleanly",
    ):
        await program.find_line(text)
    assert await program.stop() == 0
    assert "Traceback" not in program.output


async def test_lifecycle_nodes_are_brought_up_in_order(system: System) -> None:
    """The second one when the first one is active."""
    program = await system.python("-m", "actors", "launch", "examples/launch/lifecycle.launch.py")
    await program.find_line("[second]: Activated")
    steps = re.findall(r"\[(first|second)\]: (\w+)", program.output)
    assert steps == [(name, step) for name in ("first", "second") for step in ("Configured", "Activated")]
    assert await program.stop() == 0
    assert "Traceback" not in program.output


def test_course_is_the_same_in_all_languages() -> None:
    """The three launch files result in the same plan."""
    folder = ROOT / "examples" / "launch"
    library = Files()
    plans = [
        make_plan(
            library.description(str(path)), library, arguments={"a": "7"}, environment={}, folder=str(folder)
        )
        for path in sorted(folder.glob("course.launch.*"))
    ]
    assert len(plans) == 3
    assert plans[0]
    assert plans[0] == plans[1] == plans[2]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_short_and_say_what_they_are(path: Path) -> None:
    """They have at most 60 lines, a docstring, and use only the public API."""
    text = path.read_text()
    assert len(text.splitlines()) <= {"course_decorated": 80, "zenoh_only": 120}.get(path.stem, 60)
    assert text.startswith('"""')
    public = r"actors|actors\.(launch|testing|threads)|actors\.interfaces\.\w+\.(msg|srv|action)|broker"
    imports = re.findall(r"^(?:from|import) ((?:actors|broker|proto)[\w.]*)", text, re.MULTILINE)
    assert [name for name in imports if not re.fullmatch(public, name)] == []
