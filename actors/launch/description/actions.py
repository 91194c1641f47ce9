"""Actions: what a launch file can ask for, as data.

Each takes a `condition`; without one it always takes place. What they mean together is the plan's to say.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeAlias, cast

from actors.launch.description.substitutions import Substitution, Text
from actors.launch.description.validation import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.launch.description.conditions import Condition
    from actors.launch.description.event_handlers import EventHandler, Reaction
    from actors.launch.description.lifecycle import ChangeState
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
        value_type: `str`, `int`, `float` or `bool`, or a list of one, such as `list[str]`; None: as YAML
            reads it.
    """

    value: Scalar | Text | Sequence[Scalar]
    _: KW_ONLY
    value_type: type[Scalar | list[Any]] | None = None


@dataclass(frozen=True, kw_only=True)
class Action(Part):
    """Something to do.

    A class derived from it has `execute`, which is called with the `LaunchContext` as an `OpaqueFunction` is.

    Raises:
        LaunchError: An argument cannot be what it is meant to be.
    """

    noun: ClassVar[str] = "action"

    condition: Condition | None = None


@dataclass(frozen=True, kw_only=True)
class Launched(Action):
    """The options that all actions have that start a process.

    Attributes:
        condition: When to carry it out; None: always.
        cwd: The working folder of the process; None: the one of `callboard launch`.
        env: Its whole environment; None: the one that is set at this place of the description.
        additional_env: Variables to add to that.
        prefix: A command to start it with, such as "gdb -ex run --args".
        output: Where its lines go: "screen", "log", "both", "own_log" or "full".
        emulate_tty: Whether its stdout and stderr are a terminal.
        depends_on: What must be in the graph before it is started: a `Node` with a name, or "node NAME",
            "topic NAME" or "service NAME"; one of these, or a list of them. Names are relative to the current
            namespace.
        depends_timeout: Seconds to wait for these. If they do not appear, the process counts as failed.
        respawn: Whether to start it again when it ends, whatever its exit code.
        respawn_delay: Seconds until then, at least `actors.launch.planning.steps.LEAST_RESPAWN_DELAY_SEC`.
        respawn_backoff: Factor by which the delay grows each time. It is reset when the process has run for
            twice `respawn_max_delay`.
        respawn_max_delay: The longest delay, in seconds. A longer `respawn_delay` overrides it.
        respawn_max_retries: How often to start it again; -1: without limit.
        sigterm_timeout: Seconds between SIGINT and SIGTERM; None: as the launch has it.
        sigkill_timeout: Seconds between SIGTERM and SIGKILL; None: as the launch has it.
        required: Whether the launch ends when it ends. The launch fails if it died.
        on_exit: What to do whenever it ends. `Shutdown()` alone is the same as `required=True`, except that
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
    """A program with a node in it: of an installed package, a Python file, or a class.

    Attributes:
        package: The package, with `executable`.
        executable: One of its console scripts; without a package, a program by its path or along PATH.
        script: A Python file instead; a relative path starts at the folder of the launch file.
        node: A node class instead, or a function that returns a new node, or "module:Class". It runs in the
            launch's own process, so it must not block, and shares its working folder.
        exec_name: For the label of its lines; None: the node's name, or else the program's.
        name: The node's name; None: as the program sets it.
        namespace: The node's namespace, within the one that has been pushed.
        parameters: Mappings of parameters, and paths of YAML files, relative to the folder of the launch
            file. The last value of a parameter counts.
        remappings: Pairs of a name and the one to use instead.
        arguments: Arguments for the program itself.
        ros_arguments: Further arguments after `--ros-args`.
        shell: Whether `/bin/sh` reads the texts of `arguments`, which are not quoted for it.
        condition: When to carry it out; None: always.
        cwd: The working folder of the process; None: the one of `callboard launch`.
        env: Its whole environment; None: the one that is set at this place of the description.
        additional_env: Variables to add to that.
        prefix: A command to start it with, such as "gdb -ex run --args".
        output: Where its lines go: "screen", "log", "both", "own_log" or "full".
        emulate_tty: Whether its stdout and stderr are a terminal.
        depends_on: What must be in the graph before it is started: a `Node` with a name, or "node NAME",
            "topic NAME" or "service NAME"; one of these, or a list of them. Names are relative to the current
            namespace.
        depends_timeout: Seconds to wait for these. If they do not appear, the process counts as failed.
        respawn: Whether to start it again when it ends, whatever its exit code.
        respawn_delay: Seconds until then, at least `actors.launch.planning.steps.LEAST_RESPAWN_DELAY_SEC`.
        respawn_backoff: Factor by which the delay grows each time. It is reset when the process has run for
            twice `respawn_max_delay`.
        respawn_max_delay: The longest delay, in seconds. A longer `respawn_delay` overrides it.
        respawn_max_retries: How often to start it again; -1: without limit.
        sigterm_timeout: Seconds between SIGINT and SIGTERM; None: as the launch has it.
        sigkill_timeout: Seconds between SIGTERM and SIGKILL; None: as the launch has it.
        required: Whether the launch ends when it ends. The launch fails if it died.
        on_exit: What to do whenever it ends. `Shutdown()` alone is the same as `required=True`, except that
            the first end counts, also with `respawn=True`.
    """

    package: Text | None = None
    executable: Text | None = None
    script: Text | None = None
    node: Factory | str | None = None
    exec_name: Text | None = None
    name: Text | None = None
    namespace: Text | None = None
    parameters: Sequence[Parameters] = ()
    remappings: Iterable[tuple[Text, Text]] = ()
    arguments: Sequence[Text] = ()
    ros_arguments: Sequence[Text] = ()
    shell: bool | Text = False


@dataclass(frozen=True, kw_only=True)
class ExecuteProcess(Launched):
    """Any program.

    Attributes:
        cmd: The program and its arguments.
        name: For the label of its lines; None: the program's name.
        shell: Whether `/bin/sh` reads the texts of `cmd`, joined by spaces, as one line.
        condition: When to carry it out; None: always.
        cwd: The working folder of the process; None: the one of `callboard launch`.
        env: Its whole environment; None: the one that is set at this place of the description.
        additional_env: Variables to add to that.
        prefix: A command to start it with, such as "gdb -ex run --args".
        output: Where its lines go: "screen", "log", "both", "own_log" or "full".
        emulate_tty: Whether its stdout and stderr are a terminal.
        depends_on: What must be in the graph before it is started: a `Node` with a name, or "node NAME",
            "topic NAME" or "service NAME"; one of these, or a list of them. Names are relative to the current
            namespace.
        depends_timeout: Seconds to wait for these. If they do not appear, the process counts as failed.
        respawn: Whether to start it again when it ends, whatever its exit code.
        respawn_delay: Seconds until then, at least `actors.launch.planning.steps.LEAST_RESPAWN_DELAY_SEC`.
        respawn_backoff: Factor by which the delay grows each time. It is reset when the process has run for
            twice `respawn_max_delay`.
        respawn_max_delay: The longest delay, in seconds. A longer `respawn_delay` overrides it.
        respawn_max_retries: How often to start it again; -1: without limit.
        sigterm_timeout: Seconds between SIGINT and SIGTERM; None: as the launch has it.
        sigkill_timeout: Seconds between SIGTERM and SIGKILL; None: as the launch has it.
        required: Whether the launch ends when it ends. The launch fails if it died.
        on_exit: What to do whenever it ends. `Shutdown()` alone is the same as `required=True`, except that
            the first end counts, also with `respawn=True`.
    """

    cmd: Sequence[Text]
    name: Text | None = None
    shell: bool | Text = False


@dataclass(frozen=True)
class DeclareLaunchArgument(Action):
    """An argument of the launch file, given as `name:=value`.

    Attributes:
        name: Its name.
        default_value: Its value when it is not given; None: it is required.
        description: One line for people.
        choices: The values it can have; None: any.
        condition: When to carry it out; None: always.
    """

    name: str
    _: KW_ONLY
    default_value: Text | None = None
    description: str = ""
    choices: Sequence[str] | None = None


@dataclass(frozen=True)
class LogInfo(Action):
    """A line to show.

    Attributes:
        msg: The text.
        condition: When to carry it out; None: always.
    """

    _: KW_ONLY
    msg: Text


@dataclass(frozen=True)
class GroupAction(Action):
    """Actions in a scope of their own: what they push, set and declare applies to them only.

    Attributes:
        actions: The actions.
        scoped: False: what they set applies after the group, too.
        forwarding: Whether they see the arguments that are set outside.
        launch_configurations: Values to set first, by name.
        condition: When to carry it out; None: always.
    """

    actions: Sequence[Action]
    _: KW_ONLY
    scoped: bool = True
    forwarding: bool = True
    launch_configurations: Mapping[str, Text] = field(default_factory=dict[str, Text])


@dataclass(frozen=True, kw_only=True)
class Setting(Action):
    """Something that holds from here on, to the end of the group or file."""


@dataclass(frozen=True)
class PushNamespace(Setting):
    """Put nodes into this namespace, within the one that has been pushed before.

    Applies from here to the end of the group or file.

    Attributes:
        namespace: The namespace.
        condition: When to carry it out; None: always.
    """

    namespace: Text


PushRosNamespace = PushNamespace


@dataclass(frozen=True)
class SetLaunchConfiguration(Setting):
    """Set the value of `LaunchConfiguration(name)`.

    Applies from here to the end of the group or file.

    Attributes:
        name: The name.
        value: The value.
        condition: When to carry it out; None: always.
    """

    name: Text
    value: Text


@dataclass(frozen=True)
class SetEnvironmentVariable(Setting):
    """Set an environment variable for programs.

    Applies from here to the end of the group or file.

    Attributes:
        name: The variable.
        value: Its value.
        condition: When to carry it out; None: always.
    """

    name: Text
    value: Text


@dataclass(frozen=True)
class UnsetEnvironmentVariable(Setting):
    """Remove an environment variable for programs.

    Applies from here to the end of the group or file.

    Attributes:
        name: The variable.
        condition: When to carry it out; None: always.
    """

    name: Text


@dataclass(frozen=True)
class AppendEnvironmentVariable(Setting):
    """Add to an environment variable for programs.

    Applies from here to the end of the group or file.

    Attributes:
        name: The variable. If it is not set, or empty, it becomes `value`.
        value: What to add.
        prepend: Whether to add it at the beginning.
        separator: The text in between.
        condition: When to carry it out; None: always.
    """

    name: Text
    value: Text
    _: KW_ONLY
    prepend: bool | Text = False
    separator: Text = ":"


@dataclass(frozen=True)
class SetParameter(Setting):
    """Set a parameter of nodes that do not set it themselves.

    Applies from here to the end of the group or file.

    Attributes:
        name: The parameter.
        value: Its value.
        condition: When to carry it out; None: always.
    """

    name: Text
    value: ParameterEntry


@dataclass(frozen=True)
class SetRemap(Setting):
    """Make nodes use another name.

    Of two rules that match the first one counts, and a node's own rules come later, as in ROS 2.

    Attributes:
        src: The name.
        dst: The one to use instead.
        condition: When to carry it out; None: always.
    """

    src: Text
    dst: Text


@dataclass(frozen=True)
class IncludeLaunchDescription(Action):
    """Another launch file, in a scope of its own.

    It gets the arguments and variables that are set here.

    Attributes:
        launch_description_source: The file, or a `PythonLaunchDescriptionSource` of it; a relative path
            starts at the folder of this launch file.
        launch_arguments: Arguments for it, as a mapping or as pairs.
        scoped: False: what it sets, and its arguments, apply after it, too.
        condition: When to carry it out; None: always.
    """

    launch_description_source: Text
    _: KW_ONLY
    launch_arguments: Mapping[str, Text] | Iterable[tuple[str, Text]] = ()
    scoped: bool = True

    @property
    def given(self) -> Iterable[tuple[str, Text]]:
        """The arguments, as pairs."""
        return cast("Iterable[tuple[str, Text]]", dict(cast("Any", self.launch_arguments)).items())


@dataclass(frozen=True)
class TimerAction(Action):
    """Actions for later.

    Attributes:
        period: Seconds until then.
        actions: The actions.
        condition: When to carry it out; None: always.
    """

    _: KW_ONLY
    period: float | Text
    actions: Sequence[Action]


@dataclass(frozen=True)
class Shutdown(Action):
    """End the launch.

    Attributes:
        reason: A text for people.
        condition: When to carry it out; None: always.
    """

    _: KW_ONLY
    reason: Text = "the launch file says so"


@dataclass(frozen=True, kw_only=True)
class EmitEvent(Action):
    """Cause an event: `ChangeState`, or ROS 2's form of `Shutdown`.

    Attributes:
        event: The ChangeState or Shutdown.
        condition: When to carry it out; None: always.
    """

    event: Shutdown | ChangeState


@dataclass(frozen=True)
class OpaqueFunction(Action):
    """A function that returns actions.

    It is called when the description is planned; in a timer or an event handler, when these are due.

    Attributes:
        function: Called with the `LaunchContext` and the arguments below; returns actions, or None.
        args: Further arguments.
        kwargs: Further arguments by name.
        condition: When to carry it out; None: always.
    """

    _: KW_ONLY
    function: Callable[..., Any]
    args: Iterable[Any] = ()
    kwargs: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True)
class RegisterEventHandler(Action):
    """React to something from here on, whenever it happens.

    Attributes:
        event_handler: What to react to, and how.
        condition: When to carry it out; None: always.
    """

    event_handler: EventHandler

    @property
    def actions(self) -> Sequence[Action]:
        """What is done then, as far as it is known before."""
        return self.event_handler.actions
