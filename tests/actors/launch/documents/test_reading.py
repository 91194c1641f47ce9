"""Tests of actors.launch.documents.reading: what documents describe, by way of the table of elements."""

# ruff: noqa: E501 - a case in a line

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.actions import (
    AppendEnvironmentVariable,
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    PushNamespace,
    RegisterEventHandler,
    ResetEnvironment,
    ResetLaunchConfigurations,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
    SetParameter,
    SetParametersFromFile,
    SetRemap,
    Shutdown,
    TimerAction,
    UnsetEnvironmentVariable,
)
from actors.launch.description.conditions import IfCondition, UnlessCondition
from actors.launch.description.description import LaunchDescription
from actors.launch.description.event_handlers import (
    OnNodeUp,
    OnProcessExit,
    OnProcessIO,
    OnProcessStart,
    OnServiceAvailable,
    OnShutdown,
    OnStateTransition,
    OnTopicPublished,
)
from actors.launch.description.lifecycle import LifecycleNode, LifecycleTransition
from actors.launch.description.process_actions import ExecuteProcess, Node, ParameterValue, RosBridge
from actors.launch.description.substitutions import EnvironmentVariable, LaunchConfiguration
from actors.launch.documents.elements import ELEMENTS
from actors.launch.documents.reading import read_document
from actors.launch.errors import LaunchFileError
from actors.launch.planning.plan import make_plan
from tests.actors.launch.fake_library import FakeLibrary

if TYPE_CHECKING:
    from actors.launch.description.action import Action
    from actors.launch.planning.steps import Step

VAR = LaunchConfiguration("x")
BYE = LogInfo(msg="bye")
DO = "do: [{log: {message: bye}}]"


def described(text: str, name: str = "a.launch.yaml") -> tuple[Action, ...]:
    """Return what a document describes."""
    made = read_document(f"/files/{name}", textwrap.dedent(text).encode())
    assert made.file == f"/files/{name}"
    return tuple(made.actions)


def element(text: str) -> Action:
    """Return what a single element is."""
    (action,) = described(f"launch: [{{{text}}}]")
    return action


ELEMENT_CASES: list[tuple[str, Action]] = [
    ("arg: {name: x}", DeclareLaunchArgument("x")),
    (
        "arg: {name: x, default: $(var y), description: why, choice: [{value: a}, {value: 1}]}",
        DeclareLaunchArgument(
            "x", default_value=LaunchConfiguration("y"), description="why", choices=("a", "1")
        ),
    ),
    ("arg: {name: x, choices: [a, b]}", DeclareLaunchArgument("x", choices=("a", "b"))),
    ("let: {name: x, value: 5}", SetLaunchConfiguration("x", "5")),
    ("set_env: {name: A, value: true}", SetEnvironmentVariable("A", "true")),
    ("unset_env: {name: A}", UnsetEnvironmentVariable("A")),
    (
        "append_env: {name: A, value: b, prepend: true, separator: ','}",
        AppendEnvironmentVariable("A", "b", prepend=True, separator=","),
    ),
    ("set_parameter: {name: a, value: [1, 2]}", SetParameter("a", [1, 2])),
    ("set_remap: {from: a, to: $(var x)}", SetRemap("a", VAR)),
    ("push_ros_namespace: {namespace: a}", PushNamespace("a")),
    ("push-ros-namespace: {namespace: a}", PushNamespace("a")),
    ("log: {message: 'a $(var x)'}", LogInfo(msg=("a ", VAR))),
    ("shutdown: ", Shutdown()),
    ("shutdown: {reason: enough}", Shutdown(reason="enough")),
    ("timer: {period: 2, children: [{log: {message: bye}}]}", TimerAction(period=2.0, actions=(BYE,))),
    ("timer: {period: $(var x), actions: []}", TimerAction(period=VAR, actions=())),
    ("group: [{log: {message: bye}}]", GroupAction((BYE,))),
    (
        "group: {scoped: false, launch_configurations: {a: b}, children: [{log: {message: bye}}], if: $(var x)}",
        GroupAction((BYE,), scoped=False, launch_configurations={"a": "b"}, condition=IfCondition(VAR)),
    ),
    ("group: {forwarding: false, children: []}", GroupAction((), forwarding=False)),
    ("set_parameters_from_file: {filename: p.yaml}", SetParametersFromFile("p.yaml")),
    ("reset: {keep: [{name: x, value: $(var x)}]}", ResetLaunchConfigurations({"x": VAR})),
    ("reset_env: ", ResetEnvironment()),
    (
        "node: {pkg: p, exec: e, exec_name: other}",
        Node(package="p", executable="e", exec_name="other"),
    ),
    ("include: {file: b.launch.py}", IncludeLaunchDescription("b.launch.py")),
    (
        "include: {file: $(dirname)/b.toml, arg: [{name: a, value: 1}, {name: b, value: $(var x)}], unless: true}",
        IncludeLaunchDescription(
            described("launch: [{log: {message: $(dirname)/b.toml}}]")[0].msg,  # type: ignore[attr-defined]
            launch_arguments={"a": "1", "b": VAR},
            condition=UnlessCondition("true"),
        ),
    ),
    ("include: {file: b, scoped: false}", IncludeLaunchDescription("b", scoped=False)),
    ("include: {file: b, arguments: {a: 1}}", IncludeLaunchDescription("b", launch_arguments={"a": "1"})),
    ("executable: {cmd: ls -l '$(var x) y'}", ExecuteProcess(cmd=("ls", "-l", (VAR, " y")))),
    ("execute_process: {cmd: [ls, a b], name: l}", ExecuteProcess(cmd=("ls", "a b"), name="l")),
    ("ros_bridge: ", RosBridge()),
    (
        "ros_bridge: {domain_id: 7, namespace: /r, allow: /a /b, deny: [/c], config: b.toml, respawn: true}",
        RosBridge(
            domain_id=7, namespace="/r", allow=("/a", "/b"), deny=("/c",), config="b.toml", respawn=True
        ),
    ),
    ("ros_bridge: {domain_id: $(var x)}", RosBridge(domain_id=VAR)),
    (
        "node: {pkg: p, exec: e, name: n, namespace: s}",
        Node(package="p", executable="e", name="n", namespace="s"),
    ),
    ("node: {package: p, executable: $(var x)}", Node(package="p", executable=VAR)),
    ("node: {class: 'm:C', if: false}", Node(node="m:C", condition=IfCondition("false"))),
    ("node: {class: 'm:C', if: 1}", Node(node="m:C", condition=IfCondition("true"))),
    ("node: {script: a.py, args: -v 'a b'}", Node(script="a.py", arguments=("-v", "a b"))),
    ("node: {script: a.py, arguments: [-v, 1]}", Node(script="a.py", arguments=("-v", "1"))),
    (
        "node: {script: a.py, ros_args: --log-level debug}",
        Node(script="a.py", ros_arguments=("--log-level", "debug")),
    ),
    ("node: {script: a.py, remap: [{from: a, to: b}]}", Node(script="a.py", remappings=(("a", "b"),))),
    (
        "node: {script: a.py, remappings: {a: b, c: $(var x)}}",
        Node(script="a.py", remappings=(("a", "b"), ("c", VAR))),
    ),
    ("node: {script: a.py, parameters: p.yaml}", Node(script="a.py", parameters=("p.yaml",))),
    (
        "node: {script: a.py, parameters: {a: {b: 1}, c: x}}",
        Node(script="a.py", parameters=({"a": {"b": 1}, "c": "x"},)),
    ),
    (
        "node: {script: a.py, parameters: [p.yaml, {a: 1.5}]}",
        Node(script="a.py", parameters=("p.yaml", {"a": 1.5})),
    ),
    (
        "node: {script: a.py, parameters: {a: [$(var x), b], c: [true, 2]}}",
        Node(script="a.py", parameters=({"a": [(VAR,), "b"], "c": [True, 2]},)),
    ),
    (
        "node: {script: a.py, param: [{from: p.yaml}, {name: a, value: 1}, {name: g, param: [{name: b, value: [1]}]}]}",
        Node(script="a.py", parameters=("p.yaml", {"a": 1}, {"g.b": [1]})),
    ),
    (
        "node: {script: a.py, param: [{name: a, value: $(var x), type: str}, {name: b, value: 1, type: float}]}",
        Node(
            script="a.py",
            parameters=(
                {"a": ParameterValue(VAR, value_type=str)},
                {"b": ParameterValue(1, value_type=float)},
            ),
        ),
    ),
    (
        (
            "node: {script: a.py, cwd: /, launch-prefix: gdb, output: log, emulate_tty: true, depends_on: topic a,"
            " depends_timeout: 3, respawn: $(var x), respawn_delay: 1, respawn_backoff: 1, respawn_max_delay: 2,"
            " respawn_max_retries: -1, sigterm_timeout: 1, sigkill_timeout: 2.5, required: false}"
        ),
        Node(
            script="a.py",
            cwd="/",
            prefix="gdb",
            output="log",
            emulate_tty=True,
            depends_on=("topic a",),
            depends_timeout=3.0,
            respawn=VAR,
            respawn_delay=1.0,
            respawn_backoff=1.0,
            respawn_max_delay=2.0,
            respawn_max_retries=-1,
            sigterm_timeout=1.0,
            sigkill_timeout=2.5,
            required=False,
        ),
    ),
    (
        "node: {script: a.py, depends_on: [node a, service b]}",
        Node(script="a.py", depends_on=("node a", "service b")),
    ),
    ("node: {script: a.py, env: [{name: A, value: 1}]}", Node(script="a.py", additional_env={"A": "1"})),
    ("node: {script: a.py, additional_env: {A: $(var x)}}", Node(script="a.py", additional_env={"A": VAR})),
    ("node: {script: a.py, on_exit: shutdown}", Node(script="a.py", on_exit=Shutdown())),
    ("node: {script: a.py, on_exit: [{log: {message: bye}}]}", Node(script="a.py", on_exit=(BYE,))),
    (
        "lifecycle_node: {pkg: p, exec: e, name: n, autostart: true, transition_timeout: 5}",
        LifecycleNode(package="p", executable="e", name="n", autostart=True, transition_timeout=5.0),
    ),
    (
        "lifecycle_transition: {lifecycle_node_names: [a, $(var x)], transition_ids: [1, activate]}",
        LifecycleTransition(lifecycle_node_names=("a", VAR), transition_ids=("1", "activate")),
    ),
    (
        f"on_state_transition: {{target: a, transition: configure, start_state: $(var x), goal_state: active, {DO}}}",
        RegisterEventHandler(
            OnStateTransition(
                target_lifecycle_node="a",
                transition="configure",
                start_state=VAR,
                goal_state="active",
                entities=(BYE,),
            )
        ),
    ),
    (f"on_process_start: {{{DO}}}", RegisterEventHandler(OnProcessStart(on_start=(BYE,)))),
    (
        f"on_process_exit: {{target: talker, once: true, {DO}, if: 'true'}}",
        RegisterEventHandler(
            OnProcessExit(target_action="talker", handle_once=True, on_exit=(BYE,)),
            condition=IfCondition("true"),
        ),
    ),
    (
        "on_process_io: {target: a, do: [], stdout: [{log: {message: bye}}], stderr: []}",
        RegisterEventHandler(OnProcessIO(target_action="a", on_output=(), on_stdout=(BYE,), on_stderr=())),
    ),
    (f"on_shutdown: {{{DO}}}", RegisterEventHandler(OnShutdown(on_shutdown=(BYE,)))),
    (f"on_node_up: {{node: $(var x), {DO}}}", RegisterEventHandler(OnNodeUp(node=VAR, on_up=(BYE,)))),
    (
        f"on_service_available: {{service: a, {DO}}}",
        RegisterEventHandler(OnServiceAvailable(service="a", on_available=(BYE,))),
    ),
    (
        f"on_topic_published: {{topic: a, {DO}}}",
        RegisterEventHandler(OnTopicPublished(topic="a", on_published=(BYE,))),
    ),
]


@pytest.mark.parametrize(("text", "action"), ELEMENT_CASES, ids=[text for text, _ in ELEMENT_CASES])
def test_an_element_is_an_action(text: str, action: Action) -> None:
    """The same one that a Python file would have."""
    assert element(text) == action


def test_every_element_is_tested() -> None:
    """There is a case for each above."""
    tested = {text.partition(":")[0] for text, _ in ELEMENT_CASES}
    assert [each.names[0] for each in ELEMENTS if tested.isdisjoint(each.names)] == []


PARAMETERS = "node: {script: a.py, parameters: {a: "


ERROR_CASES: list[tuple[str, str]] = [
    ("nod: {}", "launch[0].nod: no such element; did you mean 'node'?"),
    ("qqqqqq: {}", "launch[0].qqqqqq: no such element; there is append_env, arg, "),
    ("", "launch[0]: expected one element, such as 'node', not 0"),
    (
        "node: {}, log: {}",
        "launch[0]: expected one element, such as 'node', not 2: node, log; what is in an element is indented further",
    ),
    ("node: 3", "launch[0].node: expected a mapping, not the number 3"),
    ("node: [a]", "launch[0].node: expected a mapping, not a list"),
    (
        "node: {script: a.py, paramters: {}}",
        "launch[0].node.paramters: no such key; did you mean 'parameters'?",
    ),
    ("log: {zzzz: 1}", "launch[0].log.zzzz: no such key; there is if, message, msg, unless"),
    ("log: {}", "launch[0].log: 'message' is missing"),
    ("log: ", "launch[0].log: 'message' is missing"),
    ("log: {message: }", "launch[0].log.message: expected a string, not nothing"),
    ("log: {message: [a]}", "launch[0].log.message: expected a string, not a list"),
    ("log: {message: $(var)}", "launch[0].log.message: '$(var)' should be $(var NAME) or"),
    ("log: {message: a, msg: b}", "launch[0].log: 'message' and 'msg' cannot both be there"),
    (
        "log: {message: a, if: true, unless: false}",
        "launch[0].log: 'if' and 'unless' cannot both be there",
    ),
    ("log: {message: a, if: 2}", "launch[0].log.if: expected true or false, not the number 2"),
    ("node: {pkg: p}", "launch[0].node: expected one of these: pkg and exec; exec; script; class"),
    ("node: {name: n}", "launch[0].node: expected one of these"),
    ("node: {script: a, exec: b}", "launch[0].node: expected one of these"),
    (
        "node: {script: a, param: [], parameters: {}}",
        "launch[0].node: 'param' and 'parameters' cannot both",
    ),
    (
        "node: {script: a, output: scren}",
        "launch[0].node.output: it cannot be 'scren'; did you mean 'screen'?",
    ),
    (
        "node: {script: a, respawn: 5}",
        "launch[0].node.respawn: expected true or false, not the number 5",
    ),
    (
        "node: {script: a, respawn_delay: true}",
        "launch[0].node.respawn_delay: expected a number, not true",
    ),
    (
        "node: {script: a, respawn_backoff: 0.5}",
        "launch[0].node.respawn_backoff: expected a number, 1 or more",
    ),
    (
        "node: {script: a, respawn_max_retries: 1.5}",
        "launch[0].node.respawn_max_retries: expected a whole number, -1 or more",
    ),
    (
        "node: {script: a, on_exit: shutdwn}",
        "launch[0].node.on_exit: expected a list, not the string 'shutdwn'",
    ),
    ('node: {script: a, args: "a \'b"}', "launch[0].node.args: 'a 'b' cannot be split into words"),
    ("node: {script: a, remap: [{from: a}]}", "launch[0].node.remap[0]: 'to' is missing"),
    ("node: {script: a, remap: [{from: a, t: b}]}", "launch[0].node.remap[0]: 'to' is missing"),
    (
        "node: {script: a, remap: {from: a, to: b}}",
        "launch[0].node.remap: expected a list of such pairs: - from: …",
    ),
    (
        "include: {file: a, arguments: {name: a, value: b}}",
        "launch[0].include.arguments: expected a list of such pairs",
    ),
    (
        "include: {file: a, arg: [{name: $(var x), value: b}]}",
        "launch[0].include.arg[0].name: expected a name without $(…), not '$(var x)'",
    ),
    (
        "include: {file: a, arg: {$(var x): b}}",
        "launch[0].include.arg.$(var x): expected a name without $(…)",
    ),
    ("arg: {name: $(var x)}", "launch[0].arg.name: expected a name without $(…)"),
    (
        "node: {script: a, parameters: {$(var x): 1}}",
        "launch[0].node.parameters.$(var x): expected a name",
    ),
    (
        "on_process_exit: {target: $(var x), do: []}",
        "launch[0].on_process_exit.target: expected a name",
    ),
    ("node: {script: a, remap: a}", "launch[0].node.remap: expected a list, not the string 'a'"),
    (
        "node: {script: a, env: [{name: a, value: b, x: c}]}",
        "launch[0].node.env[0].x: no such key",
    ),
    (
        "node: {script: a, param: [{name: a, value: 1, type: list}]}",
        "launch[0].node.param[0].type: expected one of str, int, float, bool",
    ),
    (
        "node: {script: a, param: [{name: a, value: {b: 1}, type: int}]}",
        "launch[0].node.param[0].value: expected a string, not a mapping",
    ),
    ("node: {script: a, param: [{name: a}]}", "launch[0].node.param[0]: 'value' is missing"),
    (
        "node: {script: a, param: [{from: a, name: b}]}",
        "launch[0].node.param[0].name: no such key",
    ),
    (f"{PARAMETERS}~}}}}", "launch[0].node.parameters.a: expected a string, not nothing"),
    (f"{PARAMETERS}[1, [2]]}}}}", "launch[0].node.parameters.a[1]: expected a string, not a list"),
    (f"{PARAMETERS}{{b: ['$(x)']}}}}}}", "launch[0].node.parameters.a.b[0]: No substitution 'x'"),
    ("executable: {cmd: ''}", "launch[0].executable.cmd: it is empty"),
    ("executable: {cmd: []}", "launch[0].executable.cmd: it is empty"),
    (
        "lifecycle_transition: {lifecycle_node_names: ' ', transition_ids: 1}",
        "launch[0].lifecycle_transition.lifecycle_node_names: it is empty",
    ),
    ("group: {children: [{nod: {}}]}", "launch[0].group.children[0].nod: no such element"),
    ("group: [{log: {}}]", "launch[0].group[0].log: 'message' is missing"),
    (
        "group: {children: [], scoped: 'no'}",
        "launch[0].group.scoped: expected true or false, not the string 'no'",
    ),
    (
        "timer: {period: x, children: 5}",
        "launch[0].timer.children: expected a list, not the number 5",
    ),
    ("arg: {name: a, choice: [{valu: a}]}", "launch[0].arg.choice[0]: 'value' is missing"),
    ("on_process_exit: {target: a}", "launch[0].on_process_exit: 'do' is missing"),
]


@pytest.mark.parametrize(("text", "error"), ERROR_CASES, ids=[text for text, _ in ERROR_CASES])
def test_what_is_wrong_is_reported_with_its_place(text: str, error: str) -> None:
    """The file, the line, the element and what is wrong there."""
    with pytest.raises(LaunchFileError) as caught:
        element(text)
    assert str(caught.value).startswith(f"/files/a.launch.yaml, line 1: {error}")


@pytest.mark.parametrize(
    ("name", "text", "error"),
    [
        ("a.yaml", "", "/files/a.yaml: a launch file begins with 'launch:' and a list of elements"),
        ("a.yaml", "- a", "/files/a.yaml: a launch file begins with 'launch:'"),
        ("a.yaml", "lunch: []", "/files/a.yaml: 'launch' is missing"),
        ("a.yaml", "launch: []\nx: 1", "/files/a.yaml, line 2: x: no such key"),
        ("a.yaml", "launch: 3", "/files/a.yaml, line 1: launch: expected a list, not the number 3"),
        (
            "a.yml",
            "launch:\n- log:\n    message: a\n    b: c",
            "/files/a.yml, line 4: launch[0].log.b: no such key",
        ),
        (
            "a.yml",
            "launch:\n- log:\n    message: a\n    if: 7",
            "/files/a.yml, line 4: launch[0].log.if: expected true or",
        ),
        ("a.yml", "launch:\n- log:\n   a: [", "/files/a.yml, line 4: it is not YAML: "),
        (
            "a.yml",
            "launch:\n- log: 1\n  log: 2",
            "/files/a.yml, line 3: launch[0]: the key 'log' is there twice",
        ),
        (
            "a.toml",
            "[[launch]]\nlog = 3",
            "/files/a.toml: launch[0].log: expected a mapping, not the number 3",
        ),
        (
            "a.toml",
            "launch = [{log = {message = 2026-01-01}}]",
            "/files/a.toml: launch[0].log.message: expected a string, not a date; put it in quotes",
        ),
        ("a.toml", "launch = ", "/files/a.toml: it is not TOML: Invalid value"),
    ],
)
def test_what_is_wrong_with_a_file_is_reported(name: str, text: str, error: str) -> None:
    """With its line, where the language's reader knows it."""
    with pytest.raises(LaunchFileError) as caught:
        described(text, name)
    assert str(caught.value).startswith(error)


YAML = """
launch:
  - arg: {name: robot, default: r2}
  - group:
      - push_ros_namespace: {namespace: $(var robot)}
      - set_parameter: {name: rate, value: 2}
      - node:
          pkg: py_pubsub
          exec: my_publisher
          name: my_publisher_node
          param:
            - {name: text, value: hi}
            - {name: limit, value: $(env LIMIT 10)}
          respawn: true
      - node:
          script: sub.py
          remap: [{from: chatter, to: news}]
          env: [{name: MODE, value: quiet}]
  - timer:
      period: 2.0
      children:
        - shutdown: {reason: enough}
"""

TOML = """
[[launch]]
arg = {name = "robot", default = "r2"}

[[launch]]
[[launch.group]]
push_ros_namespace = {namespace = "$(var robot)"}
[[launch.group]]
set_parameter = {name = "rate", value = 2}
[[launch.group]]
[launch.group.node]
package = "py_pubsub"
executable = "my_publisher"
name = "my_publisher_node"
parameters = {text = "hi", limit = "$(env LIMIT 10)"}
respawn = true
[[launch.group]]
[launch.group.node]
script = "sub.py"
remappings = {chatter = "news"}
additional_env = {MODE = "quiet"}

[[launch]]
timer = {period = 2.0, actions = [{shutdown = {reason = "enough"}}]}
"""

PYTHON = LaunchDescription(
    [
        DeclareLaunchArgument("robot", default_value="r2"),
        GroupAction(
            [
                PushNamespace(LaunchConfiguration("robot")),
                SetParameter("rate", 2),
                Node(
                    package="py_pubsub",
                    executable="my_publisher",
                    name="my_publisher_node",
                    parameters=[{"text": "hi"}, {"limit": EnvironmentVariable("LIMIT", default_value="10")}],
                    respawn=True,
                ),
                Node(script="sub.py", remappings=[("chatter", "news")], additional_env={"MODE": "quiet"}),
            ]
        ),
        TimerAction(period=2.0, actions=[Shutdown(reason="enough")]),
    ]
)


def planned(description: LaunchDescription) -> list[Step]:
    """Return the plan of a description."""
    return make_plan(
        description, FakeLibrary(), arguments={"robot": "r3"}, environment={"LIMIT": "7"}, folder="/files"
    )


@pytest.mark.parametrize(("name", "text"), [("a.launch.yaml", YAML), ("a.launch.toml", TOML)])
def test_the_same_plan_comes_of_every_language(name: str, text: str) -> None:
    """A launch in YAML and one in TOML come to what the Python file does."""
    assert planned(read_document(f"/files/{name}", text.encode())) == planned(PYTHON)


def test_lists_of_parameters_may_have_substitutions_in_them() -> None:
    """Each is a value of its own, and what a substitution gives is read as YAML."""
    text = "launch: [{node: {script: a.py, parameters: {a: [$(var robot), 'x y'], b: [1, $(env LIMIT)]}}}]"
    (step,) = planned(read_document("/files/a.yaml", text.encode()))
    process: Any = step
    assert process.process.command[-4:] == ("-p", "a:=[r3, x y]", "-p", "b:=[1, 7]")


def test_numbers_in_yaml_are_strings_as_they_are_written() -> None:
    """Where a string is expected, so that `1.10` is no `1.1`; also of a parameter of the type str."""
    text = """
launch:
- arg: {name: version, default: 1.10}
- node:
    script: a.py
    args: 1e3 010 $(var version)
    env: [{name: RELEASE, value: 010}]
    param:
    - {name: a, value: 1.50, type: str}
    - {name: b, value: [0x10, 1_0], type: str}
    - {name: c, value: [010, 1.50]}
"""
    (step,) = make_plan(
        read_document("/files/a.yaml", text.encode()), FakeLibrary(), arguments={}, environment={}, folder="/"
    )
    process: Any = step
    command = process.process.command
    assert command[-10:-6] == ("1e3", "010", "1.10", "--ros-args")
    assert command[-5::2] == ('a:="1.50"', 'b:=["0x10", "1_0"]', "c:=[8.0, 1.5]")
    assert process.process.environment["RELEASE"] == "010"
