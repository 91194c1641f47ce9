"""ROS 2's names for launch descriptions, with its arguments and defaults."""

from __future__ import annotations

import importlib
import sys
import typing
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch import LaunchError
from actors.launch.description.process_actions import OutputMode
from actors.launch.planning.events import ShuttingDown
from actors.launch.planning.plan import make_plan
from actors.launch.planning.steps import AddHandler, LogText, Start, Step
from actors.ros.finder import LIBRARIES, RosFinder
from actors.ros.launch import (
    Action,
    Condition,
    Event,
    EventHandler,
    InvalidLaunchFileError,
    LaunchContext,
    LaunchDescription,
    LaunchDescriptionEntity,
    LaunchIntrospector,
    LaunchService,
    actions,
    conditions,
    descriptions,
    event_handlers,
    events,
    launch_description_sources,
    logging,
    substitutions,
    utilities,
)
from actors.ros.launch.library import ros_files
from tests.actors.launch.fake_library import FakeLibrary, scope

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from tests.actors.meeting import Meeting


def steps(*given: Any, **files: Any) -> list[Step]:
    """Return what actions come to."""
    return make_plan(
        LaunchDescription(given), FakeLibrary(**files), arguments={}, environment={}, folder="/files"
    )


def process(action: Any) -> Any:
    """Return the process that an action comes to."""
    (step,) = steps(action)
    assert isinstance(step, Start)
    return step.process


def test_names_are_found_by_those_of_ros_2() -> None:
    """Packages, and the modules that ROS 2 has for single classes; nothing else."""
    assert {"launch", "launch_ros", "launch_xml", "launch_yaml", "ament_index_python"} <= set(LIBRARIES)
    found = RosFinder(force=True)
    importlib.import_module("actors.ros.launch_ros.actions")
    for name in (
        "launch.actions.execute_process",
        "launch.actions.shutdown_action",
        "launch.launch_description",
        "launch_ros.actions.node",
        "launch_xml.launch_description_sources",
        "launch_yaml.launch_description_sources",
    ):
        spec = found.find_spec(name, None)
        assert spec is not None, name
        assert spec.loader is not None
        assert spec.loader.create_module(spec) is not None
    assert found.find_spec("launch.actions.none", None) is None


def test_entities_can_be_annotated() -> None:
    """Actions and descriptions are entities, and `List[LaunchDescriptionEntity]` is a type."""
    entities = [actions.LogInfo(msg="x"), Action(), LaunchDescription()]
    assert all(isinstance(each, LaunchDescriptionEntity) for each in entities)
    assert not isinstance("x", LaunchDescriptionEntity)
    assert [isinstance(each, Action) for each in entities] == [True, True, False]
    assert not isinstance(entities[0], type("Mine", (Action,), {}))
    assert typing.get_args(typing.List[LaunchDescriptionEntity]) == (LaunchDescriptionEntity,)  # noqa: UP006


def test_processes_have_the_defaults_of_ros_2() -> None:
    """Output to the log, the same delay each time, and the prefix of an argument of the launch."""
    found = process(actions.ExecuteProcess(cmd=["ls"], respawn=True, cached_output=True, log_cmd=True))
    assert (found.output, found.respawn_backoff, found.command) == (OutputMode.LOG, 1.0, ("ls",))
    prefix = actions.SetLaunchConfiguration("launch-prefix", "time")
    (start,) = steps(prefix, actions.ExecuteProcess(cmd=["ls"], prefix=None, output="screen"))
    assert isinstance(start, Start)
    assert (start.process.output, start.process.command) == (OutputMode.SCREEN, ("time", "ls"))
    program = descriptions.Executable(cmd=["ls"], arguments=["-l"], name="list")
    local = process(actions.ExecuteLocal(process_description=program, output="both"))
    assert (local.label, local.command, local.output) == ("list-1", ("ls", "-l"), OutputMode.BOTH)


@pytest.mark.parametrize(
    ("output", "mode"),
    [
        ({"both": "screen"}, OutputMode.SCREEN),
        ({"stdout": "screen", "stderr": "log"}, OutputMode.BOTH),
        ({"stdout": ["screen", "own_log"], "stderr": "log"}, OutputMode.FULL),
    ],
)
def test_output_of_both_streams_goes_to_one_place(output: Any, mode: OutputMode) -> None:
    """That which shows at least as much as a mapping of streams says."""
    assert process(actions.ExecuteProcess(cmd=["ls"], output=output)).output is mode


def test_an_include_sets_what_applies_after_it() -> None:
    """As in ROS 2."""
    inner = LaunchDescription([actions.DeclareLaunchArgument("x", default_value="1", choices=None)])
    source = launch_description_sources.FrontendLaunchDescriptionSource("inner")
    include = actions.IncludeLaunchDescription(source, launch_arguments=None)
    found = steps(include, actions.LogInfo(msg=substitutions.LaunchConfiguration("x")), inner=inner)
    assert found == [LogText(text="1")]


def test_a_description_takes_others_in() -> None:
    """Their actions are its own; it can be described, and its arguments are known."""
    inner = LaunchDescription([actions.DeclareLaunchArgument("x", default_value="1")])
    outer = LaunchDescription([inner, actions.LogInfo(msg="a")], deprecated_reason="old")
    assert len(outer.entities) == 2
    assert [each.name for each in outer.get_launch_arguments()] == ["x"]
    text = LaunchIntrospector().format_launch_description(outer)
    assert text.splitlines()[1] == "LogInfo(msg='a')"


class Repeat(Action):
    """An action of a program's own."""

    def __init__(self, times: int, **given: Any) -> None:
        super().__init__(**given)
        self.times = times

    def execute(self, context: Any) -> Sequence[Any]:
        return [actions.LogInfo(msg=context.launch_configurations["x"])] * self.times


def test_a_program_has_actions_and_conditions_of_its_own() -> None:
    """They see what is set at their place."""
    here = actions.SetLaunchConfiguration("x", "hello")
    no = Condition(predicate=lambda context: context.launch_configurations["x"] == "bye")
    found = steps(here, Repeat(2), Repeat(1, condition=no))
    assert found == [LogText(text="hello")] * 2
    assert steps(Action()) == []


def test_handlers_and_events_have_the_arguments_of_ros_2() -> None:
    """Shutdown events, ends of processes, and output."""
    one = actions.ExecuteProcess(cmd=["one"])
    end = actions.EmitEvent(event=events.Shutdown(reason="done"))
    handlers = [
        event_handlers.OnExecutionComplete(target_action=one, on_completion=[end]),
        event_handlers.OnProcessIO(target_action=one, on_stdin=None, on_stdout=lambda event: None),
        event_handlers.OnShutdown(
            on_shutdown=[actions.LogInfo(msg=substitutions.LocalSubstitution("event.reason", "why"))]
        ),
    ]
    found = steps(one, *map(actions.RegisterEventHandler, handlers), actions.Shutdown())
    reacts = [each for each in found if isinstance(each, AddHandler)]
    assert [each.what for each in reacts] == [
        "that ExecuteProcess exits",
        "that ExecuteProcess writes to stdout",
        "the launch ends",
    ]
    assert reacts[2].steps(ShuttingDown("done")) == [LogText(text="done")]
    timer = actions.TimerAction(period=1.0, actions=iter([end]), cancel_on_shutdown=False)
    assert steps(timer)[0].after_sec == 1.0


def test_a_handler_chooses_events_by_a_function() -> None:
    """`EventHandler` itself has a matcher and actions."""
    log = actions.LogInfo(msg="matched")
    handler = EventHandler(matcher=lambda event: isinstance(event, ShuttingDown), entities=[log])
    (react,) = steps(actions.RegisterEventHandler(handler))
    assert isinstance(react, AddHandler)
    assert [react.matches(each) for each in (ShuttingDown("done"), Event())] == [True, False]
    assert react.steps(ShuttingDown("done")) == [LogText(text="matched")]
    nothing, *_ = steps(actions.RegisterEventHandler(EventHandler(matcher=lambda event: True)))
    assert isinstance(nothing, AddHandler)
    assert nothing.steps(Event()) == []


@pytest.mark.parametrize(
    ("module", "name"),
    [
        (events.process, "matches_name"),
        (events.process, "matches_pid"),
        (events.process, "matches_executable"),
    ],
    ids=str,
)
def test_what_is_absent_says_so(module: Any, name: str) -> None:
    """With what to do instead, where it is used and not where it is imported."""
    with pytest.raises(Exception, match=f"callboard has no {name}: "):
        getattr(module, name)(1, a=2)


@pytest.mark.parametrize(
    "name", ["OpaqueCoroutine", "UnregisterEventHandler", "SignalProcess", "ShutdownProcess"]
)
def test_what_is_absent_may_be_in_a_branch_that_is_not_taken(name: str) -> None:
    """And if it is taken, the error says what to do instead."""
    if hasattr(actions, name):
        made = getattr(actions, name)(1, a=2)
    else:
        made = actions.EmitEvent(event=getattr(events.process, name)(process_matcher=lambda action: True))
    assert steps(actions.GroupAction([made], condition=conditions.IfCondition("false"))) == []
    with pytest.raises(LaunchError, match=f"callboard has no {name}: "):
        steps(made)


def test_substitutions_have_the_arguments_of_ros_2() -> None:
    """Defaults that are no texts, and options that callboard does without."""
    here = scope(environment={"PATH": "echo"})
    assert substitutions.LaunchConfiguration("x", default=5).perform(here) == "5"
    assert substitutions.LaunchConfiguration("x", default=["a", "b"]).perform(here) == "ab"
    assert substitutions.PythonExpression(["1 + ", "2"], ["math"]).perform(here) == "3"
    assert substitutions.Command("echo a", on_stderr="ignore").perform(here) == "echo a said"
    assert substitutions.LaunchLogDir().perform(here) == "/log/of/this/launch"
    texts = utilities.normalize_to_list_of_substitutions(["a", substitutions.TextSubstitution("b")])
    assert utilities.perform_substitutions(here, texts) == "ab"
    assert conditions.evaluate_condition_expression(here, "true")
    assert conditions.IfCondition("1").evaluate(here)
    assert logging.get_logger("launch") is not None


def test_paths_and_texts_are_joined() -> None:
    """By operators, and with a text between them."""
    here = scope()
    assert (substitutions.PathSubstitution(["a", "b"]) / "c" / ["d", ".py"]).perform(here) == "a/b/c/d.py"
    assert substitutions.StringJoinSubstitution(["a", ["b", "c"]], ", ").perform(here) == "a, bc"


def test_actions_are_repeated() -> None:
    """For values in YAML, and for numbers."""

    def greet(name: str, times: int = 1) -> list[Any]:
        return [actions.LogInfo(msg=name)] * times

    values = actions.SetLaunchConfiguration("values", "{name: a};{times: 2, name: b};")
    each = actions.ForEach(substitutions.LaunchConfiguration("values"), function=greet)
    loop = actions.ForLoop("2", function=lambda i: [actions.LogInfo(msg=str(i))], condition=None)
    found = steps(values, each, loop, actions.ForLoop("1", function=lambda i: None))
    assert found == [LogText(text=text) for text in ("a", "b", "b", "0", "1")]
    with pytest.raises(LaunchError, match="ForLoop needs a whole number, not 'x'"):
        steps(actions.ForLoop("x", function=lambda i: None))
    for wrong in ("[1]", "{"):
        with pytest.raises(LaunchError, match="ForEach needs mappings such as"):
            steps(actions.ForEach(wrong, function=greet))


def test_the_environment_is_replaced() -> None:
    """Programs get the new variables and no others."""
    (start,) = steps(
        actions.SetEnvironmentVariable("A", "1"),
        actions.ReplaceEnvironmentVariables({"B": "2"}),
        actions.ExecuteProcess(cmd=["ls"]),
    )
    assert isinstance(start, Start)
    assert start.process.environment == {"B": "2"}


def test_arguments_are_checked() -> None:
    """By functions for actions of a program's own."""
    assert utilities.is_a(1, int)
    assert utilities.is_a_subclass(bool, int)
    assert not utilities.is_a_subclass("a", int)
    utilities.ensure_argument_type("a", [int, str], "name")
    with pytest.raises(TypeError, match="'name' of Node must be of type str, not int: 1"):
        utilities.ensure_argument_type(1, str, "name", "Node")


def test_programs_import_ros_2s_names(tmp_path: Path) -> None:
    """Those of Python are run by callboard's module; others are left alone."""
    files = ros_files(force=True)
    script = tmp_path / "talker"
    script.write_text("#!/usr/bin/env python3\n")
    runner = ("-u", "-m", "actors.ros", "--force")
    for command in ([str(script), "a"], [sys.executable, "-u", "b.py"], ["python3", "b.py"]):
        assert tuple(files.python_program(command))[1:5] == runner
    assert tuple(files.script(str(script)))[1:5] == runner
    for command in (["ls", "a.py"], ["python3", "-c", "print()"], [sys.executable]):
        assert files.python_program(command) == command


def test_the_programs_of_a_program_are_forced_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`--force` holds for what `LaunchService` and launch files start."""
    script = tmp_path / "talker.py"
    script.touch()
    found = [LaunchContext().library.script(str(script))]
    monkeypatch.setattr(sys, "meta_path", [RosFinder(force=True), *sys.meta_path])
    found.append(LaunchContext().library.script(str(script)))
    assert ["--force" in each for each in found] == [False, True]


def test_a_context_evaluates_substitutions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without any launch."""
    monkeypatch.setenv("A_VARIABLE", "here")
    context = LaunchContext(argv=["x:=1"], noninteractive=True)
    assert context.perform_substitution(substitutions.EnvironmentVariable("A_VARIABLE")) == "here"


def test_a_launch_file_is_read_by_a_program(tmp_path: Path) -> None:
    """In whatever language; what is wrong is a typed error."""
    file = tmp_path / "a.launch.yaml"
    file.write_text("launch: [{log: {message: hello}}]")
    read = launch_description_sources.get_launch_description_from_any_launch_file
    assert len(tuple(read(str(file)).actions)) == 1
    with pytest.raises(InvalidLaunchFileError):
        read("none.launch.py")


async def test_a_program_runs_a_launch(meeting: Meeting, capfdbinary: Any, monkeypatch: Any) -> None:
    """With arguments; the result is 1 if a process has failed or the description has an error."""
    monkeypatch.setenv("CALLBOARD_URL", meeting.url)
    for command, expected in (("true", 0), ("false", 1)):
        service = LaunchService(argv=["text:=hello", "ignored"], debug=True)
        service.include_launch_description(
            LaunchDescription(
                [
                    actions.LogInfo(msg=substitutions.LaunchConfiguration("text")),
                    actions.ExecuteProcess(cmd=[command]),
                ]
            )
        )
        assert await service.run_async() == expected
        assert b"[INFO] [launch]: hello" in capfdbinary.readouterr().out
        with pytest.raises(ValueError, match="the launch runs already"):
            service.include_launch_description(LaunchDescription())
    wrong = LaunchService()
    wrong.include_launch_description(LaunchDescription([actions.ExecuteProcess(cmd=[""])]))
    assert await wrong.run_async() == 1
    assert b"[ERROR] [launch]: ExecuteProcess" in capfdbinary.readouterr().err


async def test_a_program_ends_a_launch(meeting: Meeting, monkeypatch: Any) -> None:
    """From any thread; one that does not run yet is left alone."""
    monkeypatch.setenv("CALLBOARD_URL", meeting.url)
    service = LaunchService()
    service.shutdown()
    handler = event_handlers.OnProcessStart(on_start=lambda event: service.shutdown())
    service.include_launch_description(
        LaunchDescription(
            [actions.RegisterEventHandler(handler), actions.ExecuteProcess(cmd=["sleep", "1000"])]
        )
    )
    assert await service.run_async(shutdown_when_idle=False) == 0
