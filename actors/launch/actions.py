"""Actions: what a launch file can ask for, as data.

Each takes a `condition`; without one it always takes place. What they mean together is the plan's to say.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from actors.launch.substitutions import Substitution, Text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from actors.launch.conditions import Condition

Scalar: TypeAlias = str | int | float | bool
ParameterEntry: TypeAlias = (
    "Scalar | Substitution | Sequence[Scalar | Substitution] | Mapping[str, ParameterEntry]"
)
"""A parameter's value. What a substitution gives is read as YAML, so that "3" is a number."""
Parameters: TypeAlias = "Text | Mapping[str, ParameterEntry]"
"""Parameters by name, or the path of a YAML file of them."""


@dataclass(frozen=True, kw_only=True)
class Action:
    """Something to do."""

    condition: Condition | None = None


@dataclass(frozen=True, kw_only=True)
class Launched(Action):
    """What all actions that start a process have in common.

    Attributes:
        cwd: Where it runs; None: where `callboard launch` does.
        env: Its whole environment; None: the one that holds there.
        additional_env: What is added to that.
        prefix: What to start it with, such as "gdb -ex run --args".
        output: Where its lines go. There is only "screen".
        respawn: Whether it is started again when it ends, however that was.
        respawn_delay: Seconds until then, at least `actors.launch.plan.LEAST_RESPAWN_DELAY_SEC`.
        respawn_max_retries: How often; -1: without end.
        required: Whether its end is the end of the launch; if it died that has failed.
        on_exit: `Shutdown()` says the same as `required=True`.
    """

    cwd: Text | None = None
    env: Mapping[str, Text] | None = None
    additional_env: Mapping[str, Text] = field(default_factory=dict[str, Text])
    prefix: Text = ""
    output: Text = "screen"
    respawn: bool | Text = False
    respawn_delay: float | Text = 0.0
    respawn_max_retries: int = -1
    required: bool = False
    on_exit: Shutdown | None = None


@dataclass(frozen=True, kw_only=True)
class Node(Launched):
    """A program with a node in it: one of an installed package, or a plain Python file.

    Attributes:
        package: The package, with `executable`.
        executable: One of its console scripts.
        script: A Python file instead; a relative path is seen from the launch file's folder.
        name: The node's; None: as the program has it.
        namespace: The node's, within the one that has been pushed.
        parameters: Mappings of parameters, and paths of YAML files; of two values the last one counts.
        remappings: Pairs of a name and the one to use instead.
        arguments: For the program itself.
        ros_arguments: More of what stands behind `--ros-args`.
    """

    package: Text | None = None
    executable: Text | None = None
    script: Text | None = None
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
        cmd: The program and its arguments; no shell is involved.
        name: For the label of its lines; None: the program's.
    """

    cmd: Sequence[Text]
    name: Text | None = None


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
    """Actions in a scope of their own: what they push, set and declare holds for them only."""

    actions: Sequence[Action]


@dataclass(frozen=True)
class PushNamespace(Action):
    """From here on, to the end of the group or file, nodes are in this namespace."""

    namespace: Text


@dataclass(frozen=True)
class SetEnvironmentVariable(Action):
    """From here on, to the end of the group or file, programs get this variable."""

    name: Text
    value: Text


@dataclass(frozen=True)
class IncludeLaunchDescription(Action):
    """Another launch file, in a scope of its own.

    It sees the arguments and variables that hold here; what it sets itself stays in it.

    Attributes:
        path: The file; a relative path is seen from this launch file's folder.
        launch_arguments: Arguments for it, as a mapping or as pairs.
    """

    path: Text
    _: KW_ONLY
    launch_arguments: Mapping[str, Text] | Iterable[tuple[str, Text]] = ()


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
