"""The table of all elements: from it come the actions of a document, and the schema."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

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
from actors.launch.description.process_actions import ExecuteProcess, Node
from actors.launch.documents.element import Element, Key
from actors.launch.documents.kinds import (
    FLAG,
    NUMBER,
    PLAIN,
    PLAIN_NAME,
    SWITCH,
    TEXT,
    BoundedNumber,
    Choices,
    Kind,
    Named,
    OneOf,
    Pairs,
    Schema,
    Texts,
    read_list,
    read_mapping,
)
from actors.launch.documents.parameters import ParameterKind, ParametersKind, RosParametersKind
from actors.launch.planning.process_spec import OutputMode
from actors.tools.suggestions import did_you_mean
from proto.errors import escape

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Action, EventHandler
    from actors.launch.documents.errors import Spot


class Elements(Kind):
    """A list of elements, each a mapping of one name to its value."""

    def read(self, value: object, spot: Spot) -> tuple[Action, ...]:
        """Return the actions that they are."""
        return tuple(_action(each, spot.inner(at)) for at, each in enumerate(read_list(value, spot)))

    def schema(self) -> Schema:
        """Return its JSON schema."""
        return {"$ref": "#/definitions/elements"}


class OnExit(Kind):
    """A list of elements, or the word shutdown."""

    def read(self, value: object, spot: Spot) -> Action | tuple[Action, ...]:
        """Return the actions."""
        return Shutdown() if value == "shutdown" else _ELEMENTS.read(value, spot)

    def schema(self) -> Schema:
        """Return its JSON schema."""
        return {"anyOf": [{"enum": ["shutdown"]}, _ELEMENTS.schema()]}


def _action(value: object, spot: Spot) -> Action:
    found = read_mapping(value, spot)
    if len(found) != 1:
        listed = (
            f": {', '.join(map(escape, found))}; what is in an element is indented further" if found else ""
        )
        raise spot.error(f"one element should be here, such as 'node', not {len(found)}{listed}")
    ((name, body),) = found.items()
    element = BY_NAME.get(name)
    if element is None:
        hint = did_you_mean(name, BY_NAME) or f"; there is {', '.join(sorted(BY_NAME))}"
        raise spot.inner(name).error(f"no such element{hint}")
    return element.read(body, spot.inner(name))


_ELEMENTS: Final = Elements()


def _key(names: str, kind: Kind, about: str, target: str = "", *, required: bool = False) -> Key:
    """Return a key. Spaces separate its names; the first one is the target, unless there is another."""
    split = tuple(names.split())
    return Key(split, kind, about, target or split[0], required=required)


def _element(
    names: str,
    about: str,
    make: Callable[..., Action],
    *own: Key,
    alternatives: tuple[tuple[str, ...], ...] = (),
    listed: str = "",
) -> Element:
    """Return an element. Spaces separate its names."""
    return Element(
        names=tuple(names.split()), about=about, make=make, own=own, alternatives=alternatives, listed=listed
    )


def _handler(name: str, about: str, kind: Callable[..., EventHandler], *own: Key) -> Element:
    """Return an element for an event handler."""

    def make(*, condition: Any = None, **values: Any) -> Action:
        return RegisterEventHandler(kind(**values), condition=condition)

    return _element(name, about, make, *own, _ONCE)


_LAUNCHED: Final = (
    _key("cwd", TEXT, "Where it runs; without it, where the launch does."),
    _key("env additional_env", Named("name", "value"), "Environment variables for it.", "additional_env"),
    _key("launch-prefix prefix", TEXT, "What to start it with, such as gdb -ex run --args.", "prefix"),
    _key("output", OneOf([mode.value for mode in OutputMode]), "Where its lines go."),
    _key("emulate_tty", FLAG, "Whether its output looks like a terminal to it."),
    _key("depends_on", Texts(), "What must be there first, such as topic NAME."),
    _key("depends_timeout", NUMBER, "Seconds that this gets to come."),
    _key("respawn", FLAG, "Whether it is started again when it ends."),
    _key("respawn_delay", NUMBER, "Seconds until then."),
    _key("respawn_backoff", BoundedNumber(1), "What the delay is multiplied with each time."),
    _key("respawn_max_delay", NUMBER, "The longest delay, in seconds."),
    _key("respawn_max_retries", BoundedNumber(-1, whole=True), "How often; -1: without end."),
    _key("sigterm_timeout", NUMBER, "Seconds after SIGINT until it gets SIGTERM."),
    _key("sigkill_timeout", NUMBER, "Seconds after SIGTERM until it gets SIGKILL."),
    _key("required", FLAG, "Whether its end is the end of the launch."),
    _key("on_exit", OnExit(), "What to do when it ends: elements, or the word shutdown."),
)

_PROGRAM: Final = (
    _key("pkg package", TEXT, "An installed package, with exec.", "package"),
    _key("exec executable", TEXT, "A program of the package.", "executable"),
    _key("script", TEXT, "A Python file, seen from this file's folder."),
    _key("class", PLAIN_NAME, "module:Class of a node that runs in the launch's own process.", "node"),
    _key("exec_name", TEXT, "For the label of its lines."),
    _key("namespace", TEXT, "The node's namespace, within the one that has been pushed."),
    _key("parameters", ParametersKind(), "Parameters by name, files of them, or a list of both."),
    _key("param", RosParametersKind(), "Parameters as ROS 2 lists them.", "parameters"),
    _key("remap remappings", Pairs("from", "to"), "Names to use instead.", "remappings"),
    _key("args arguments", Texts(split=True), "Arguments for the program.", "arguments"),
    _key("ros_args ros_arguments", Texts(split=True), "More behind --ros-args.", "ros_arguments"),
    _key("shell", FLAG, "Whether /bin/sh reads the arguments."),
    *_LAUNCHED,
)
_ALTERNATIVES: Final = (("package", "executable"), ("script",), ("node",))

_NODE: Final = _element(
    "node",
    "A program with a node in it: of a package, a Python file, or a class.",
    Node,
    _key("name", TEXT, "The node's name."),
    *_PROGRAM,
    alternatives=_ALTERNATIVES,
)

_LIFECYCLE_NODE: Final = _element(
    "lifecycle_node",
    "A program with a lifecycle node in it.",
    LifecycleNode,
    _key("name", TEXT, "The node's name.", required=True),
    _key("autostart", FLAG, "Whether to configure and activate it each time that it has been started."),
    _key("transition_timeout", NUMBER, "Seconds within which each transition must be done."),
    *_PROGRAM,
    alternatives=_ALTERNATIVES,
)

_EXECUTABLE: Final = _element(
    "executable execute_process",
    "Any program.",
    ExecuteProcess,
    _key("cmd", Texts(split=True, least=1), "The program and its arguments.", required=True),
    _key("name", TEXT, "For the label of its lines."),
    _key("shell", FLAG, "Whether /bin/sh reads the command."),
    *_LAUNCHED,
)


_ONCE: Final = _key("once", SWITCH, "Whether only the first time.", "handle_once")
_TARGET: Final = _key("target", PLAIN_NAME, "The process: its label without the number.", "target_action")


def _do(target: str) -> Key:
    return _key("do", _ELEMENTS, "What to do then.", target, required=True)


_HANDLERS: Final = (
    _handler("on_process_start", "Whenever a process starts.", OnProcessStart, _TARGET, _do("on_start")),
    _handler("on_process_exit", "Whenever a process ends.", OnProcessExit, _TARGET, _do("on_exit")),
    _handler(
        "on_process_io",
        "Whenever a process writes.",
        OnProcessIO,
        _TARGET,
        _key("do", _ELEMENTS, "What to do then.", "on_output"),
        _key("stdout", _ELEMENTS, "What to do if it was stdout.", "on_stdout"),
        _key("stderr", _ELEMENTS, "What to do if it was stderr.", "on_stderr"),
    ),
    _handler(
        "on_state_transition",
        "Whenever a lifecycle node makes a step of a transition.",
        OnStateTransition,
        _key("target", PLAIN_NAME, "Its process: the label without the number.", "target_lifecycle_node"),
        _key("transition", TEXT, "The label of the step, such as transition_success."),
        _key("start_state", TEXT, "The state that it was in."),
        _key("goal_state", TEXT, "The state that it is in now."),
        _do("entities"),
    ),
    _handler("on_shutdown", "When the launch ends.", OnShutdown, _do("on_shutdown")),
    _handler(
        "on_node_up",
        "When a node is there.",
        OnNodeUp,
        _key("node", TEXT, "Its name.", required=True),
        _do("on_up"),
    ),
    _handler(
        "on_service_available",
        "When a service has a server.",
        OnServiceAvailable,
        _key("service", TEXT, "Its name.", required=True),
        _do("on_available"),
    ),
    _handler(
        "on_topic_published",
        "When a topic has a publisher.",
        OnTopicPublished,
        _key("topic", TEXT, "Its name.", required=True),
        _do("on_published"),
    ),
)

ELEMENTS: Final = (
    _element(
        "arg",
        "An argument of this file, given as name:=value.",
        DeclareLaunchArgument,
        _key("name", PLAIN_NAME, "What it is called.", required=True),
        _key("default", TEXT, "Its value when it is not given; without it, it must be.", "default_value"),
        _key("description", PLAIN, "For people: one line."),
        _key("choice choices", Choices(), "What it can be.", "choices"),
    ),
    _NODE,
    _LIFECYCLE_NODE,
    _element(
        "lifecycle_transition",
        "Transitions of lifecycle nodes, one after the other as far as they succeed.",
        LifecycleTransition,
        _key("lifecycle_node_names", Texts(least=1), "The names of the nodes.", required=True),
        _key("transition_ids", Texts(least=1), "Their numbers, or labels such as configure.", required=True),
    ),
    _EXECUTABLE,
    _element(
        "group",
        "Elements in a scope of their own.",
        GroupAction,
        _key("children actions", _ELEMENTS, "What is in it.", "actions", required=True),
        _key("scoped", SWITCH, "Whether what is set in it ends with it."),
        _key("forwarding", SWITCH, "Whether it sees the arguments that are set outside."),
        _key("launch_configurations keep", Named("name", "value"), "Arguments that are set first."),
        listed="children",
    ),
    _element(
        "include",
        "Another launch file, in a scope of its own.",
        IncludeLaunchDescription,
        _key(
            "file",
            TEXT,
            "A relative path is seen from this file's folder.",
            "launch_description_source",
            required=True,
        ),
        _key("arg let arguments", Named("name", "value"), "Arguments for it.", "launch_arguments"),
        _key("scoped", SWITCH, "Whether what is set in it ends with it."),
    ),
    _element(
        "push_ros_namespace push-ros-namespace push_namespace",
        "From here on, to the end of the group or file, nodes are in this namespace.",
        PushNamespace,
        _key("namespace", TEXT, "The namespace.", required=True),
    ),
    _element(
        "set_env",
        "From here on, to the end of the group or file, programs get this variable.",
        SetEnvironmentVariable,
        _key("name", TEXT, "The variable.", required=True),
        _key("value", TEXT, "Its value.", required=True),
    ),
    _element(
        "unset_env",
        "From here on, to the end of the group or file, programs do not get this variable.",
        UnsetEnvironmentVariable,
        _key("name", TEXT, "The variable.", required=True),
    ),
    _element(
        "append_env",
        "From here on, to the end of the group or file, programs get more in this variable.",
        AppendEnvironmentVariable,
        _key("name", TEXT, "The variable.", required=True),
        _key("value", TEXT, "What is added.", required=True),
        _key("prepend", FLAG, "Whether it is added at the beginning."),
        _key("separator", TEXT, "What stands between; without it, a colon."),
    ),
    _element(
        "let",
        "From here on, to the end of the group or file, $(var NAME) is this value.",
        SetLaunchConfiguration,
        _key("name", TEXT, "The argument.", required=True),
        _key("value", TEXT, "Its value.", required=True),
    ),
    _element(
        "set_parameter",
        "From here on, to the end of the group or file, nodes have this parameter.",
        SetParameter,
        _key("name", TEXT, "The parameter.", required=True),
        _key("value", ParameterKind(), "Its value, unless a node is given one of its own.", required=True),
    ),
    _element(
        "set_parameters_from_file",
        "From here on, to the end of the group or file, nodes have the parameters of this file.",
        SetParametersFromFile,
        _key("filename", TEXT, "A YAML file of parameters.", required=True),
    ),
    _element(
        "reset",
        "From here on, to the end of the group or file, there are no arguments but these.",
        ResetLaunchConfigurations,
        _key("keep", Named("name", "value"), "Arguments.", "launch_configurations"),
    ),
    _element("reset_env", "Programs get the environment of the launch's beginning.", ResetEnvironment),
    _element(
        "set_remap",
        "From here on, to the end of the group or file, nodes use another name.",
        SetRemap,
        _key("from", TEXT, "The name.", "src", required=True),
        _key("to", TEXT, "The one to use instead.", "dst", required=True),
    ),
    _element(
        "log log_info",
        "A line for people.",
        LogInfo,
        _key("message msg", TEXT, "What to say.", "msg", required=True),
    ),
    _element(
        "timer",
        "Elements for later.",
        TimerAction,
        _key("period", NUMBER, "In how many seconds.", required=True),
        _key("children actions", _ELEMENTS, "What to do then.", "actions", required=True),
    ),
    _element("shutdown", "The end of the launch.", Shutdown, _key("reason", TEXT, "For people.")),
    *_HANDLERS,
)

BY_NAME: Final = {name: element for element in ELEMENTS for name in element.names}
