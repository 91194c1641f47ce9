"""The actions that start a process, and their options."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.launch.description.action import Action
from actors.launch.description.substitutions import Substitution, Text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from actors.launch.description.action import Reaction
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
class ProcessAction(Action):
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
class Node(ProcessAction):
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
class ExecuteProcess(ProcessAction):
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
