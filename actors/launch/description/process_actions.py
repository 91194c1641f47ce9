"""The actions that start a process, and the table of their options."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.launch.description.action import Action
from actors.launch.description.options import option, required

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from actors.launch.description.action import Reaction
    from actors.launch.description.substitutions import Substitution, Text
    from actors.runtime.programs import Factory

Scalar: TypeAlias = str | int | float | bool
ParameterItem: TypeAlias = "Scalar | Substitution | Sequence[Substitution | str]"
ParameterEntry: TypeAlias = (
    "Scalar | Substitution | ParameterValue | Sequence[ParameterItem] | Mapping[str, ParameterEntry]"
)
"""The value of a parameter. The result of a substitution is read as YAML, so that "3" is a number; a list
that contains a substitution is one string in pieces."""
Parameters: TypeAlias = "Text | Mapping[str, ParameterEntry]"
"""Parameters by name, or the path of a YAML file of them."""

DEPENDS_TIMEOUT_SEC: Final = 60.0
"""Long enough for a node that loads a model or waits for hardware."""


class OutputMode(Enum):
    """Where the lines of a process go; the words are ROS 2's."""

    SCREEN = "screen"
    LOG = "log"
    """To the launch's log file; stderr to the screen, too."""
    BOTH = "both"
    OWN_LOG = "own_log"
    """To log files of its own: all of it, stdout alone, and stderr alone."""
    FULL = "full"
    """All of these."""

    @property
    def splits(self) -> bool:
        """Whether stdout and stderr go different ways."""
        return self not in {OutputMode.SCREEN, OutputMode.BOTH}


@dataclass(frozen=True)
class ParameterValue:
    """A parameter's value with an explicit type, so that a string that looks like a number stays a string.

        Node(…, parameters=[{"robot_description": ParameterValue(Command(["xacro ", path]), value_type=str)}])

    Attributes:
        value: The value.
        value_type: `str`, `int`, `float` or `bool`, or a list of one, such as `list[str]`; None: the type
            that YAML gives it.
    """

    value: Scalar | Text | Sequence[Scalar]
    _: KW_ONLY
    value_type: type[Scalar | list[Any]] | None = None


@dataclass(frozen=True, kw_only=True)
class ProcessAction(Action):
    """An action that starts a process."""

    cwd: Text | None = option(
        None, "The working folder of the process; by default that of `callboard launch`."
    )
    # In documents `env` adds variables, as in ROS 2's.
    env: Mapping[str, Text] | None = option(
        None,
        "The whole environment of the process; by default the one set so far in the description.",
        keys="",
    )
    additional_env: Mapping[str, Text] = option(
        {}, "Variables to add to the environment.", keys="env additional_env"
    )
    prefix: Text | None = option(
        None,
        "A command to start the process with, such as `gdb -ex run --args`; by default that of the"
        " command line.",
        keys="launch-prefix prefix",
    )
    output: Text = option(
        "screen",
        "Where the lines of the process go: screen, log, both, own_log or full.",
        choices=[each.value for each in OutputMode],
    )
    emulate_tty: bool | Text = option(False, "Whether stdout and stderr of the process are a terminal.")
    depends_on: Node | Text | Sequence[Node | Text] = option(
        (),
        "What must be in the graph before the process is started: node NAME, topic NAME or service NAME,"
        " in Python also a `Node` with a name; one of these, or a list. Names are relative to the current"
        " namespace.",
    )
    depends_timeout: float | Text = option(
        DEPENDS_TIMEOUT_SEC,
        "Seconds to wait for the dependencies. If they do not appear, the process counts as failed.",
        unit="s",
        unlimited=True,
    )
    respawn: bool | Text = option(
        False, "Whether to start the process again when it ends, whatever its exit code."
    )
    respawn_delay: float | Text = option(
        0.0, "Seconds between the end of the process and its restart, at least 0.1.", unit="s"
    )
    respawn_backoff: float | Text = option(
        2.0,
        "Factor by which the delay grows with each restart. It is reset when the process has run for"
        " twice `respawn_max_delay`.",
        least=1,
    )
    respawn_max_delay: float | Text = option(
        5.0, "The longest delay in seconds. A longer `respawn_delay` overrides it.", unit="s"
    )
    respawn_max_retries: int | Text = option(
        -1, "How often to restart the process; -1: without limit.", least=-1
    )
    sigterm_timeout: float | Text | None = option(
        None, "Seconds between SIGINT and SIGTERM; by default those of the launch.", unit="s"
    )
    sigkill_timeout: float | Text | None = option(
        None, "Seconds between SIGTERM and SIGKILL; by default those of the launch.", unit="s"
    )
    required: bool | Text = option(
        False, "Whether the launch ends when the process ends. It fails if the process died."
    )
    on_exit: Reaction | None = option(
        None,
        "What to do whenever the process ends. A Shutdown alone is the same as `required`, except that"
        " the first end counts, also with `respawn`.",
    )


@dataclass(frozen=True, kw_only=True)
class Node(ProcessAction, element="node"):
    """A program with a node in it: of an installed package, a Python file, or a class."""

    package: Text | None = option(None, "The package of `executable`.", keys="pkg package")
    executable: Text | None = option(
        None,
        "A program of the package; without a package, a path or a program along PATH.",
        keys="exec executable",
    )
    script: Text | None = option(
        None, "A Python file instead; a relative path starts at the folder of the launch file."
    )
    node: Factory | str | None = option(
        None,
        "A node class instead, as module:Class; in Python also the class, or a function that returns a"
        " new node. It runs in the launch's own process, so it must not block, and shares its working"
        " folder.",
        keys="class",
    )
    exec_name: Text | None = option(
        None, "The label of its lines; by default the node's name, or else the program's."
    )
    name: Text | None = option(None, "The node's name; by default the one that the program sets.")
    namespace: Text | None = option(None, "The node's namespace, within the one that has been pushed.")
    parameters: Sequence[Parameters] = option(
        (),
        "Parameters by name, and paths of YAML files, relative to the folder of the launch file. The last"
        " value of a parameter counts.",
    )
    remappings: Iterable[tuple[Text, Text]] = option(
        (), "Pairs of a name and the one to use instead.", keys="remap remappings"
    )
    arguments: Sequence[Text] = option((), "Arguments for the program itself.", keys="args arguments")
    ros_arguments: Sequence[Text] = option(
        (), "Further arguments after `--ros-args`.", keys="ros_args ros_arguments"
    )
    shell: bool | Text = option(False, "Whether /bin/sh reads the arguments, which are not quoted for it.")


@dataclass(frozen=True, kw_only=True)
class ExecuteProcess(ProcessAction, element="executable execute_process"):
    """Any program."""

    cmd: Sequence[Text] = field(metadata=required("The program and its arguments."))
    name: Text | None = option(None, "The label of its lines; by default the program's name.")
    shell: bool | Text = option(False, "Whether /bin/sh reads the command, joined by spaces, as one line.")


@dataclass(frozen=True, kw_only=True)
class RosBridge(ProcessAction, element="ros_bridge"):
    """A bridge to ROS 2, as `callboard bridge ros2`."""

    domain_id: int | Text | None = option(
        None, "The domain of ROS 2; by default the one of ROS_DOMAIN_ID, or of `config`."
    )
    namespace: Text | None = option(
        None,
        "The namespace in callboard of the names of ROS 2, such as /robot1; within the namespace that"
        " has been pushed.",
    )
    allow: Sequence[Text] = option(
        (), "Patterns of the topics, services and actions that cross; by default all do."
    )
    deny: Sequence[Text] = option((), "Patterns of those that do not cross, also if they are allowed.")
    config: Text | None = option(
        None,
        "A TOML file with further options; a relative path starts at the folder of the launch file.",
    )
    name: Text = option("ros_bridge", "The label of its lines.")
