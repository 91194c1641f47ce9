"""Actions: what a launch file can ask for, as data.

Each takes a `condition`; without one it always takes place. What they mean together is the plan's to say.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeAlias, cast

from actors.launch.description.shapes import Part
from actors.launch.description.substitutions import Substitution, Text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.launch.description.conditions import Condition
    from actors.launch.description.event_handlers import EventHandler, Reaction
    from actors.runtime.programs import Factory

Scalar: TypeAlias = str | int | float | bool
ParameterItem: TypeAlias = "Scalar | Substitution | Sequence[Substitution | str]"
ParameterEntry: TypeAlias = (
    "Scalar | Substitution | ParameterValue | Sequence[ParameterItem] | Mapping[str, ParameterEntry]"
)
"""A parameter's value. What a substitution gives is read as YAML, so that "3" is a number; a list
with one in it is a text in pieces."""
Parameters: TypeAlias = "Text | Mapping[str, ParameterEntry]"
"""Parameters by name, or the path of a YAML file of them."""

DEPENDS_TIMEOUT_SEC: Final = 60.0
"""Seconds within which the dependencies of a process must appear."""


@dataclass(frozen=True)
class ParameterValue:
    """A parameter's value whose type is said, so that a text stays one that looks like something else.

        Node(…, parameters=[{"robot_description": ParameterValue(Command(["xacro ", path]), value_type=str)}])

    Attributes:
        value: The value.
        value_type: `str`, `int`, `float` or `bool`; None: as YAML reads it.
    """

    value: Scalar | Text
    _: KW_ONLY
    value_type: type[Scalar] | None = None


@dataclass(frozen=True, kw_only=True)
class Action(Part):
    """Something to do.

    Raises:
        LaunchError: An argument cannot be what it is meant to be.
    """

    noun: ClassVar[str] = "action"

    condition: Condition | None = None


@dataclass(frozen=True, kw_only=True)
class Launched(Action):
    """What all actions that start a process have in common.

    Attributes:
        cwd: Where it runs; None: where `callboard launch` does.
        env: Its whole environment; None: the one that holds there.
        additional_env: What is added to that.
        prefix: What to start it with, such as "gdb -ex run --args".
        output: Where its lines go: "screen", "log", "both", "own_log" or "full".
        emulate_tty: Whether its output looks like a terminal to it.
        depends_on: What must be there before it is started: a `Node` that has a name, or "node NAME", "topic
            NAME" or "service NAME"; one of these, or a list of them. A name is seen from the namespace there.
        depends_timeout: Seconds that these get to come; without them it is not started, as if it had died.
        respawn: Whether it is started again when it ends, however that was.
        respawn_delay: Seconds until then, at least `actors.launch.planning.steps.LEAST_RESPAWN_DELAY_SEC`.
        respawn_backoff: What the delay is multiplied with each time. It is as at first again when the process
            has lived twice `respawn_max_delay`.
        respawn_max_delay: The longest delay, in seconds; a longer `respawn_delay` stands.
        respawn_max_retries: How often; -1: without end.
        sigterm_timeout: Seconds after SIGINT until it gets SIGTERM; None: as the launch has it.
        sigkill_timeout: Seconds after SIGTERM until it gets SIGKILL; None: as the launch has it.
        required: Whether its end is the end of the launch; if it died that has failed.
        on_exit: What to do whenever it ends. `Shutdown()` alone says the same as `required=True`, but that
            the first end counts, also with `respawn=True`.
    """

    cwd: Text | None = None
    env: Mapping[str, Text] | None = None
    additional_env: Mapping[str, Text] = field(default_factory=dict[str, Text])
    prefix: Text = ""
    output: Text = "screen"
    emulate_tty: bool | Text = False
    depends_on: Node | Text | Sequence[Node | Text] = ()
    depends_timeout: float | Text = DEPENDS_TIMEOUT_SEC
    respawn: bool | Text = False
    respawn_delay: float | Text = 0.0
    respawn_backoff: float | Text = 2.0
    respawn_max_delay: float | Text = 5.0
    respawn_max_retries: int | Text = -1
    sigterm_timeout: float | Text | None = None
    sigkill_timeout: float | Text | None = None
    required: bool | Text = False
    on_exit: Reaction | None = None


@dataclass(frozen=True, kw_only=True)
class Node(Launched):
    """A program with a node in it: of an installed package, a plain Python file, or a class.

    Attributes:
        package: The package, with `executable`.
        executable: One of its console scripts.
        script: A Python file instead; a relative path is seen from the launch file's folder.
        node: A node class instead, or a function that returns a new node, or "module:Class". It runs in the
            launch's own process, so that it must not block, and shares its environment and working folder.
        name: The node's; None: as the program has it.
        namespace: The node's, within the one that has been pushed.
        parameters: Mappings of parameters, and paths of YAML files, seen from the launch file's folder; of
            two values the last one counts.
        remappings: Pairs of a name and the one to use instead.
        arguments: For the program itself.
        ros_arguments: More of what stands behind `--ros-args`.
    """

    package: Text | None = None
    executable: Text | None = None
    script: Text | None = None
    node: Factory | str | None = None
    name: Text | None = None
    namespace: Text | None = None
    parameters: Sequence[Parameters] = ()
    remappings: Iterable[tuple[Text, Text]] = ()
    arguments: Sequence[Text] = ()
    ros_arguments: Sequence[Text] = ()


@dataclass(frozen=True, kw_only=True)
class ExecuteProcess(Launched):
    """Any program.

    Attributes:
        cmd: The program and its arguments.
        name: For the label of its lines; None: the program's.
        shell: Whether `/bin/sh` reads the texts of `cmd`, with spaces between them, as a line of its own.
    """

    cmd: Sequence[Text]
    name: Text | None = None
    shell: bool | Text = False


@dataclass(frozen=True)
class DeclareLaunchArgument(Action):
    """An argument of the launch file, given as `name:=value`.

    Attributes:
        name: What it is called.
        default_value: What it is when it is not given; None: it must be given.
        description: For people: one line.
        choices: What it can be; None: anything.
    """

    name: str
    _: KW_ONLY
    default_value: Text | None = None
    description: str = ""
    choices: Sequence[str] | None = None


@dataclass(frozen=True)
class LogInfo(Action):
    """A line for people.

    Attributes:
        msg: What to say.
    """

    _: KW_ONLY
    msg: Text


@dataclass(frozen=True)
class GroupAction(Action):
    """Actions in a scope of their own: what they push, set and declare holds for them only.

    Attributes:
        actions: The actions.
        scoped: False: what they set holds after the group, too.
        launch_configurations: Values that are set first, by name.
    """

    actions: Sequence[Action]
    _: KW_ONLY
    scoped: bool = True
    launch_configurations: Mapping[str, Text] = field(default_factory=dict[str, Text])


@dataclass(frozen=True, kw_only=True)
class Setting(Action):
    """Something that holds from here on, to the end of the group or file."""


@dataclass(frozen=True)
class PushNamespace(Setting):
    """Nodes are in this namespace, within the one that has been pushed before."""

    namespace: Text


PushRosNamespace = PushNamespace


@dataclass(frozen=True)
class SetLaunchConfiguration(Setting):
    """`LaunchConfiguration(name)` is this value."""

    name: Text
    value: Text


@dataclass(frozen=True)
class SetEnvironmentVariable(Setting):
    """Programs get this variable."""

    name: Text
    value: Text


@dataclass(frozen=True)
class UnsetEnvironmentVariable(Setting):
    """Programs do not get this variable."""

    name: Text


@dataclass(frozen=True)
class AppendEnvironmentVariable(Setting):
    """Programs get more in this variable.

    Attributes:
        name: The variable; if it is not set, or empty, the value is all of it.
        value: What is added.
        prepend: Whether it is added at the beginning.
        separator: What stands between.
    """

    name: Text
    value: Text
    _: KW_ONLY
    prepend: bool | Text = False
    separator: Text = ":"


@dataclass(frozen=True)
class SetParameter(Setting):
    """Nodes have this parameter, unless they are given a value of their own."""

    name: Text
    value: ParameterEntry


@dataclass(frozen=True)
class SetRemap(Setting):
    """Nodes use another name.

    Of two rules that match the first one counts, and a node's own come later, as in ROS 2.

    Attributes:
        src: The name.
        dst: The one to use instead.
    """

    src: Text
    dst: Text


@dataclass(frozen=True)
class IncludeLaunchDescription(Action):
    """Another launch file, in a scope of its own.

    It sees the arguments and variables that hold here; what it sets itself stays in it.

    Attributes:
        launch_description_source: The file, or a `PythonLaunchDescriptionSource` of it; a relative path is
            seen from this launch file's folder.
        launch_arguments: Arguments for it, as a mapping or as pairs.
    """

    launch_description_source: Text
    _: KW_ONLY
    launch_arguments: Mapping[str, Text] | Iterable[tuple[str, Text]] = ()

    @property
    def given(self) -> Iterable[tuple[str, Text]]:
        """The arguments, as pairs."""
        return cast("Iterable[tuple[str, Text]]", dict(cast("Any", self.launch_arguments)).items())


@dataclass(frozen=True)
class TimerAction(Action):
    """Actions for later.

    Attributes:
        period: In how many seconds.
        actions: What to do then.
    """

    _: KW_ONLY
    period: float | Text
    actions: Sequence[Action]


@dataclass(frozen=True)
class Shutdown(Action):
    """The end of the launch.

    Attributes:
        reason: For people.
    """

    _: KW_ONLY
    reason: Text = "the launch file says so"


@dataclass(frozen=True, kw_only=True)
class EmitEvent(Action):
    """ROS 2's way to say `Shutdown`.

    Attributes:
        event: The Shutdown.
    """

    event: Shutdown


@dataclass(frozen=True)
class OpaqueFunction(Action):
    """A function that gives actions.

    It is called when the description is planned; in a timer or an event handler, when these are due.

    Attributes:
        function: Called with the `LaunchContext` and what follows here; returns actions, or None.
        args: Further arguments.
        kwargs: Further arguments by name.
    """

    _: KW_ONLY
    function: Callable[..., Any]
    args: Iterable[Any] = ()
    kwargs: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True)
class RegisterEventHandler(Action):
    """From here on react to something whenever it happens.

    Attributes:
        event_handler: To what, and how.
    """

    event_handler: EventHandler

    @property
    def actions(self) -> Sequence[Action]:
        """What is done then, as far as it is known before."""
        return self.event_handler.actions
