"""What descriptions come to. Nothing is read or started: the library is made up."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.action import Action
from actors.launch.description.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    OpaqueFunction,
    PushNamespace,
    RegisterEventHandler,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
    SetParameter,
    SetRemap,
    Shutdown,
    TimerAction,
    UnsupportedAction,
)
from actors.launch.description.conditions import IfCondition, UnlessCondition
from actors.launch.description.description import LaunchDescription
from actors.launch.description.description_source import PythonLaunchDescriptionSource
from actors.launch.description.event_handlers import OnShutdown
from actors.launch.description.process_actions import ExecuteProcess, Node, RosBridge
from actors.launch.description.substitutions import (
    EnvironmentVariable,
    LaunchConfiguration,
    ThisLaunchFile,
    ThisLaunchFileDir,
)
from actors.launch.errors import LaunchError, UnknownArgumentError
from actors.launch.planning.plan import make_plan
from actors.launch.planning.process_spec import LEAST_RESPAWN_DELAY_SEC, ProcessSpec
from actors.launch.planning.steps import End, LogText, Start, Step
from tests.actors.launch.fake_library import FakeLibrary

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Text


def steps(*actions: Action, given: dict[str, str] | None = None, **files: LaunchDescription) -> list[Step]:
    """Return what actions come to."""
    return make_plan(
        LaunchDescription(actions),
        FakeLibrary(**files),
        arguments=given or {},
        environment={"HOME": "/me"},
        folder="/files",
    )


def processes(*actions: Action, **options: Any) -> list[ProcessSpec]:
    """Return the processes that actions come to."""
    return [step.process for step in steps(*actions, **options) if isinstance(step, Start)]


def said(*actions: Action, **options: Any) -> list[str]:
    """Return the lines that actions come to."""
    return [step.text for step in steps(*actions, **options) if isinstance(step, LogText)]


def test_a_node_of_a_package_becomes_its_command() -> None:
    """The label is the node's name, or the program's; the number counts all processes."""
    first, second, third = processes(
        Node(package="py_pubsub", executable="talker", name="t", namespace="ns1", arguments=["-v"]),
        Node(package="py_pubsub", executable="talker"),
        Node(script="sub/plain.py"),
    )
    assert first.command == ("py_pubsub:talker", "-v", "--ros-args", "-r", "__node:=t", "-r", "__ns:=/ns1")
    assert first.shown == "callboard run py_pubsub talker -v --ros-args -r __node:=t -r __ns:=/ns1"
    assert second.command == ("py_pubsub:talker",)
    assert third.command == ("python", "/files/sub/plain.py")
    assert [each.label for each in (first, second, third)] == ["t-1", "talker-2", "plain-3"]


def test_a_process_is_as_it_is_described() -> None:
    """Prefix, folder and environment; `env` is all of it, `additional_env` more."""
    first, second = processes(
        ExecuteProcess(
            cmd=["/bin/echo", ["a", "b"]], prefix="nice -n 5", cwd="/w", additional_env={"A": "1"}
        ),
        ExecuteProcess(cmd=["x"], name="y", env={"B": EnvironmentVariable("HOME")}),
    )
    assert (first.command, first.cwd) == (("nice", "-n", "5", "/bin/echo", "ab"), "/w")
    assert (first.label, second.label) == ("echo-1", "y-2")
    assert (first.environment, first.own_environment) == ({"HOME": "/me", "A": "1"}, {"A": "1"})
    assert second.environment == {"B": "/me"}


def test_a_bridge_is_the_command_with_its_options() -> None:
    """Paths are relative to the launch file, and namespaces to the one that has been pushed."""
    plain, full, inner, innermost = processes(
        RosBridge(respawn=True),
        RosBridge(
            domain_id=LaunchConfiguration("domain"),
            namespace="robot1",
            allow=["/camera/**", "/tf"],
            deny=["/camera/raw"],
            config="bridge.toml",
            name="first",
        ),
        GroupAction([PushNamespace("fleet"), RosBridge(domain_id=7), RosBridge(namespace="robot2")]),
        given={"domain": "3"},
    )
    assert (plain.label, plain.shown, plain.respawn) == ("ros_bridge-1", "callboard bridge ros2", True)
    assert plain.command == (sys.executable, "-m", "actors", "bridge", "ros2")
    assert full.label == "first-2"
    assert full.command[5:] == (
        *("--domain-id=3", "--namespace=robot1", "--config=/files/bridge.toml"),
        *("--allow=/camera/**", "--allow=/tf", "--deny=/camera/raw"),
    )
    assert inner.command[5:] == ("--domain-id=7", "--namespace=fleet")
    assert innermost.command[5:] == ("--namespace=fleet/robot2",)


def test_groups_keep_what_they_set() -> None:
    """Namespaces, variables and arguments hold to the end of the group."""
    inner, outer = processes(
        GroupAction(
            [
                PushNamespace("a"),
                PushNamespace("b"),
                SetEnvironmentVariable("X", "1"),
                DeclareLaunchArgument("here", default_value="2"),
                Node(script="s.py", namespace="c", arguments=[LaunchConfiguration("here")]),
            ]
        ),
        Node(script="s.py", arguments=[LaunchConfiguration("here", default="none")]),
    )
    assert inner.command[2:] == ("2", "--ros-args", "-r", "__ns:=/a/b/c")
    assert inner.environment["X"] == "1"
    assert outer.command[2:] == ("none",)
    assert "X" not in outer.environment


def test_a_group_may_share_its_scope_and_begin_with_values() -> None:
    """Without a scope of its own what it sets holds after it."""
    robot = LaunchConfiguration("robot", default="none")
    shared = GroupAction([LogInfo(msg=robot)], scoped=False, launch_configurations={"robot": "r2"})
    own = GroupAction([LogInfo(msg=robot)], launch_configurations={"robot": ["r", "3"]})
    assert said(own, LogInfo(msg=robot), shared, LogInfo(msg=robot)) == ["r3", "none", "r2", "r2"]


def test_what_is_set_holds_to_the_end_of_the_group() -> None:
    """Arguments, parameters and rules for names, as the nodes there get them."""
    inner, outer = processes(
        GroupAction([SetParameter("a", 1), SetRemap("x", "y"), Node(script="s.py", parameters=[{"a": 2}])]),
        Node(script="s.py"),
    )
    assert inner.command[2:] == ("--ros-args", "-p", "a:=1", "-p", "a:=2", "-r", "x:=y")
    assert outer.command[2:] == ()


def test_conditions_decide() -> None:
    """With the arguments as they are at that place."""
    sim = LaunchConfiguration("sim")
    actions = (
        DeclareLaunchArgument("sim", default_value="false"),
        LogInfo(msg="sim", condition=IfCondition(sim)),
        LogInfo(msg="real", condition=UnlessCondition(sim)),
    )
    assert said(*actions) == ["real"]
    assert said(*actions, given={"sim": "True"}) == ["sim"]


def test_timers_add_up() -> None:
    """What is in a timer is due that much later than the timer itself."""
    made = steps(
        TimerAction(
            period="1.5", actions=[LogInfo(msg="a"), TimerAction(period=2, actions=[Shutdown(reason="b")])]
        ),
        LogInfo(msg="c"),
    )
    assert made == [LogText(text="a", after_sec=1.5), End(reason="b", after_sec=3.5), LogText(text="c")]


def test_an_included_file_has_a_scope_of_its_own() -> None:
    """It sees what holds there and gets its arguments; its folder is its own, and nothing of it leaks."""
    file = LaunchDescription(
        [
            DeclareLaunchArgument("x"),
            DeclareLaunchArgument("y", default_value="y"),
            LogInfo(msg=[LaunchConfiguration("x"), LaunchConfiguration("y"), LaunchConfiguration("z"), " "]),
            LogInfo(msg=ThisLaunchFileDir()),
            PushNamespace("inner"),
            Node(script="s.py"),
        ]
    )
    given: dict[str, Text] = {"x": ["1", LaunchConfiguration("z")]}
    actions = (
        DeclareLaunchArgument("z", default_value="z"),
        PushNamespace("outer"),
        IncludeLaunchDescription("sub/f", launch_arguments=given.items()),
        Node(script="s.py"),
        LogInfo(msg=[LaunchConfiguration("y", default="-"), ThisLaunchFileDir()]),
    )
    assert said(*actions, sub_f=file) == ["1zyz ", "/files/sub", "-/files"]
    first, second = processes(*actions, sub_f=file)
    assert (first.command[1], first.command[-1]) == ("/files/sub/s.py", "__ns:=/outer/inner")
    assert (second.command[1], second.command[-1]) == ("/files/s.py", "__ns:=/outer")


def test_an_included_file_may_be_named_as_in_ros_2() -> None:
    """A source with its path in pieces, and arguments as pairs; the plan can be made again."""
    file = LaunchDescription([LogInfo(msg=[LaunchConfiguration("x"), " in ", ThisLaunchFile()])])
    include = IncludeLaunchDescription(
        PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/sub/f"]),
        launch_arguments=iter({"x": "1"}.items()),
    )
    for _ in range(2):
        assert said(include, sub_f=file) == ["1 in /files/sub/f"]


def test_a_timer_is_cancelled_with_the_one_around_it() -> None:
    """Unless both say that they survive the end of the launch."""
    inner = [
        TimerAction(period=1.0, actions=[LogInfo(msg=each)], cancel_on_shutdown=each)
        for each in ("on", "off")
    ]
    for cancel in (True, False):
        made = steps(TimerAction(period=1.0, actions=[*inner, LogInfo(msg="x")], cancel_on_shutdown=cancel))
        assert [each.cancel_on_shutdown for each in made] == [True, cancel, cancel]


def test_what_is_unsupported_may_be_in_a_branch_that_is_not_taken() -> None:
    """If it is taken, the error says what to do instead."""
    loads = UnsupportedAction(action_type="node_container", remedy="start each node")
    assert steps(GroupAction([loads], condition=IfCondition("false"))) == []
    with pytest.raises(LaunchError, match="callboard has no node_container: start each node"):
        steps(loads)


@pytest.mark.parametrize("pairs", [False, True])
def test_arguments_of_an_include_see_those_before_them(*, pairs: bool) -> None:
    """As in ROS 2, and not those of the file around it; the folder is that of the including file."""
    file = LaunchDescription([LogInfo(msg=LaunchConfiguration("url"))])
    given: dict[str, Text] = {
        "sys": "2",
        "url": ["udp://:", LaunchConfiguration("sys"), ThisLaunchFileDir()],
    }
    include = IncludeLaunchDescription("sub/f", launch_arguments=list(given.items()) if pairs else given)
    assert said(SetLaunchConfiguration("sys", "9"), include, sub_f=file) == ["udp://:2/files"]


@pytest.mark.parametrize(("forwarding", "text"), [(True, "x1"), (False, "x0")])
def test_arguments_of_a_group_see_those_before_them(*, forwarding: bool, text: str) -> None:
    """As in ROS 2; without `forwarding` they are evaluated outside of the group."""
    given: dict[str, Text] = {"a": "1", "b": ["x", LaunchConfiguration("a")]}
    group = GroupAction(
        [LogInfo(msg=LaunchConfiguration("b"))], launch_configurations=given, forwarding=forwarding
    )
    assert said(SetLaunchConfiguration("a", "0"), group) == [text]


def test_files_whose_includes_multiply_are_an_error() -> None:
    """Case 85: each file includes the next one twice, and depth alone is no limit of time."""
    files = {
        f"f{level}": LaunchDescription([IncludeLaunchDescription(f"/files/f{level + 1}")] * 2)
        for level in range(20)
    }
    with pytest.raises(LaunchError, match="includes more than 2000 files"):
        said(IncludeLaunchDescription("/files/f0"), f20=LaunchDescription(()), **files)


def test_a_file_that_includes_itself_is_an_error() -> None:
    """Rather than the end of the stack."""
    with pytest.raises(LaunchError, match="/files/f is 32 files deep; does one include itself"):
        steps(IncludeLaunchDescription("f"), f=LaunchDescription([IncludeLaunchDescription("f")]))


@pytest.mark.parametrize(
    "actions",
    [
        [DeclareLaunchArgument("known", default_value="1")],
        [LogInfo(msg=LaunchConfiguration("known"))],
        [GroupAction([DeclareLaunchArgument("known")], condition=IfCondition("0"))],
        [IncludeLaunchDescription("f")],
        [IncludeLaunchDescription("none", condition=IfCondition("0"))],
    ],
)
def test_an_argument_that_somebody_knows_may_be_given(actions: list[Action]) -> None:
    """Declared or used, here or in a file, or perhaps in one that is not included now."""
    file = LaunchDescription([DeclareLaunchArgument("known")])
    assert isinstance(steps(*actions, given={"known": "x"}, f=file), list)


@pytest.mark.parametrize(
    "unclear",
    [
        RegisterEventHandler(OnShutdown(on_shutdown=lambda _: None)),
        TimerAction(period=1, actions=[OpaqueFunction(function=lambda _: None)]),
        IncludeLaunchDescription("none", condition=IfCondition("0")),
    ],
)
def test_an_argument_that_is_likely_to_be_wrong_is_warned_of(unclear: Action) -> None:
    """Where a function, or a file that is not included now, may know it; and what was meant is reported."""
    warned = said(DeclareLaunchArgument("robot", default_value=""), unclear, given={"robto": "1"})
    assert warned == ["No launch argument 'robto' is declared; did you mean 'robot'?"]


def test_an_argument_of_a_file_that_is_not_included_now_is_known() -> None:
    """Its file is asked."""
    file = LaunchDescription([DeclareLaunchArgument("x")])
    include = IncludeLaunchDescription("f", condition=IfCondition("0"))
    assert said(include, given={"x": "1"}, f=file) == []


def test_an_argument_that_nobody_knows_is_an_error() -> None:
    """Which says what there is."""
    with pytest.raises(UnknownArgumentError) as error:
        steps(
            DeclareLaunchArgument("b", default_value=""),
            DeclareLaunchArgument("a"),
            given={"a": "1", "c": "2"},
        )
    assert (error.value.name, error.value.known) == ("c", ("a", "b"))


def test_respawn_is_bounded_below() -> None:
    """Its delay has a least value; `on_exit=Shutdown()` is `required`; yes and no may be arguments."""
    quick, slow = processes(
        Node(script="s.py", respawn="1", required=True),
        Node(script="s.py", respawn=True, respawn_delay=2, respawn_max_retries=3, on_exit=Shutdown()),
    )
    assert (quick.respawn, quick.respawn_delay_sec, quick.respawn_max_retries, quick.required) == (
        *(True, LEAST_RESPAWN_DELAY_SEC, -1, True),
    )
    assert (slow.respawn_delay_sec, slow.respawn_max_retries, slow.required) == (2.0, 3, True)


@pytest.mark.parametrize("event", [False, True])
def test_shutdown_at_the_end_of_a_process_is_the_end(event: bool) -> None:
    """Its reason is reported, and a respawn does not come before it; a condition makes it a handler."""
    bye = Shutdown(reason="over")
    end = EmitEvent(event=bye) if event else bye
    (start,) = steps(Node(script="s.py", respawn=True, on_exit=[end]))
    assert isinstance(start, Start)
    spec = start.process
    assert (spec.required, spec.end_reason, spec.respawn, start.on_exit) == (True, "over", False, None)
    (spec,) = processes(Node(script="s.py", on_exit=Shutdown()))
    assert (spec.required, spec.end_reason) == (True, "")
    perhaps = Shutdown(reason="over", condition=IfCondition("0"))
    (start,) = steps(Node(script="s.py", required=True, respawn=True, on_exit=perhaps))
    assert isinstance(start, Start)
    assert start.process.respawn
    assert start.on_exit is not None


def test_a_shell_reads_a_command_as_a_line() -> None:
    """The label is the program's, wherever that stands."""
    line = ["/bin/echo $HOME", "| ", ["c", "at"]]
    (spec,) = processes(ExecuteProcess(cmd=line, shell="true"))
    assert (spec.command, spec.name) == (("/bin/sh", "-c", "/bin/echo $HOME |  cat"), "echo")


def test_shutdown_may_be_an_event() -> None:
    """As in ROS 2."""
    assert steps(EmitEvent(event=Shutdown(reason="over"))) == [End(reason="over")]


def test_numbers_may_be_texts() -> None:
    """Such as launch arguments."""
    two = LaunchConfiguration("two")
    (spec,) = processes(
        DeclareLaunchArgument("two", default_value="2"),
        Node(script="s.py", respawn=True, respawn_max_retries=two, respawn_backoff=[two, ".5"]),
    )
    assert (spec.respawn_max_retries, spec.respawn_backoff) == (2, 2.5)


@pytest.mark.parametrize(
    ("action", "error"),
    [
        (Node(), "A Node needs package= and executable=, or script="),
        (Node(package="p", script="s"), "A Node needs"),
        (Node(package="e"), "A Node needs"),
        (ExecuteProcess(cmd=[]), "ExecuteProcess needs a program"),
        (RosBridge(domain_id="seven"), "domain_id must be a whole number, 0 or more, not 'seven'"),
        (
            ExecuteProcess(cmd=["a"], output="paper"),
            "output must be one of screen, log, both, own_log, full, not 'paper'",
        ),
        (ExecuteProcess(cmd=["a"], prefix="'"), "prefix ''' is not a command: No closing quotation"),
        (ExecuteProcess(cmd=["a"], name=""), "A process cannot have the name ''"),
        (ExecuteProcess(cmd=["a"], name="x" * 201), "it has 1 to 200 printable characters"),
        (ExecuteProcess(cmd=["a"], respawn="maybe"), "Expected true or false, got 'maybe'"),
        (
            ExecuteProcess(cmd=["a"], respawn_backoff="0.5"),
            "respawn_backoff must be a number, 1 or more, not",
        ),
        (
            ExecuteProcess(cmd=["a"], respawn_max_retries="1.5"),
            "respawn_max_retries must be a whole number, -1 or more, not '1.5'",
        ),
        (ExecuteProcess(cmd=["a"], respawn_max_retries="some"), "respawn_max_retries must be a whole number"),
        (TimerAction(period="soon", actions=[]), "period must be a number of seconds, 0 or more, not 'soon'"),
        (TimerAction(period=-1, actions=[]), "period must be a number"),
        (DeclareLaunchArgument("a"), "Launch argument 'a' is required"),
        (DeclareLaunchArgument("a", default_value="1", choices=["2"]), "'a' must be one of 2, not '1'"),
        (Action(), "Action is not an action that can be carried out"),
        (GroupAction([ExecuteProcess(cmd=["a"])] * 1001), "more than 1000 processes"),
    ],
)
def test_what_is_wrong_is_found_before_the_start(action: Action, error: str) -> None:
    """In one line that says what would be right."""
    with pytest.raises(LaunchError) as caught:
        steps(action)
    assert error in str(caught.value)


@pytest.mark.parametrize(
    ("line", "name"),
    [(". ./setup.sh; echo hi", "sh"), ("/ a", "sh"), (f"{'x' * 300} a", "sh"), ("/bin/echo hi", "echo")],
)
def test_a_shells_line_has_a_name_in_any_case(line: str, name: str) -> None:
    """Nobody has chosen it: its first word's, if that can be one."""
    (process,) = processes(ExecuteProcess(cmd=[line], shell=True))
    assert (process.name, process.command) == (name, ("/bin/sh", "-c", line))
