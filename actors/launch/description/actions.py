"""Actions as data, except those that start processes. `planning/` carries them out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.description.action import Action, Setting
from actors.launch.description.options import option, required

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from actors.launch.description.action import EventHandler
    from actors.launch.description.lifecycle import ChangeState
    from actors.launch.description.process_actions import ParameterEntry
    from actors.launch.description.substitutions import Text


@dataclass(frozen=True)
class DeclareLaunchArgument(Action, element="arg"):
    """An argument of the launch file, given as `name:=value`."""

    name: str = field(metadata=required("The name of the argument."))
    _: KW_ONLY
    default_value: Text | None = option(
        None, "Its value when it is not given; without a default it is required.", keys="default"
    )
    description: str = option("", "One line of help.")
    choices: Sequence[str] | None = option(
        None, "The values that it can have; by default any.", keys="choice choices"
    )


@dataclass(frozen=True)
class LogInfo(Action, element="log log_info"):
    """Show a message."""

    _: KW_ONLY
    msg: Text = field(metadata=required("The text.", keys="message msg"))


@dataclass(frozen=True)
class GroupAction(Action, element="group"):
    """Carry out actions in a scope of their own: what they push, set and declare applies to them only."""

    actions: Sequence[Action] = field(metadata=required("The actions.", keys="children actions"))
    _: KW_ONLY
    scoped: bool = option(True, "Whether what they set ends with the group.")
    forwarding: bool = option(
        True,
        "Whether they see what is set outside: arguments, variables, namespace, parameters, remappings. A"
        " group that is not scoped always does.",
    )
    launch_configurations: Mapping[str, Text] = option(
        {}, "Arguments to set first.", keys="launch_configurations keep"
    )


@dataclass(frozen=True)
class PushNamespace(Setting, element="push_ros_namespace push-ros-namespace push_namespace"):
    """Put nodes into this namespace, within the one that has been pushed before.

    Applies from here to the end of the group or file.
    """

    namespace: Text = field(metadata=required("The namespace."))


PushRosNamespace = PushNamespace


@dataclass(frozen=True)
class SetLaunchConfiguration(Setting, element="let"):
    """Set the value of `LaunchConfiguration(name)`.

    Applies from here to the end of the group or file.
    """

    name: Text = field(metadata=required("The argument."))
    value: Text = field(metadata=required("Its value."))


@dataclass(frozen=True)
class SetEnvironmentVariable(Setting, element="set_env"):
    """Set an environment variable for programs.

    Applies from here to the end of the group or file.
    """

    name: Text = field(metadata=required("The variable."))
    value: Text = field(metadata=required("Its value."))


@dataclass(frozen=True)
class UnsetEnvironmentVariable(Setting, element="unset_env"):
    """Remove an environment variable for programs.

    Applies from here to the end of the group or file.
    """

    name: Text = field(metadata=required("The variable."))


@dataclass(frozen=True)
class AppendEnvironmentVariable(Setting, element="append_env"):
    """Add to an environment variable for programs.

    Applies from here to the end of the group or file.
    """

    name: Text = field(metadata=required("The variable. If it is not set, or empty, it becomes the value."))
    value: Text = field(metadata=required("What to add."))
    _: KW_ONLY
    prepend: bool | Text = option(False, "Whether to add it at the beginning.")
    separator: Text = option(":", "The text in between.")


@dataclass(frozen=True)
class SetParameter(Setting, element="set_parameter"):
    """Set a parameter of nodes that do not set it themselves.

    Applies from here to the end of the group or file.
    """

    name: Text = field(metadata=required("The parameter."))
    value: ParameterEntry = field(metadata=required("Its value."))


@dataclass(frozen=True)
class SetRemap(Setting, element="set_remap"):
    """Make nodes use another name.

    Of two rules that match the first one counts, and a node's own rules come later, as in ROS 2.
    """

    src: Text = field(metadata=required("The name.", keys="from"))
    dst: Text = field(metadata=required("The one to use instead.", keys="to"))


@dataclass(frozen=True, kw_only=True)
class PushLaunchConfigurations(Setting):
    """Save the arguments, namespace, parameters and remappings, until `PopLaunchConfigurations`."""


@dataclass(frozen=True, kw_only=True)
class PopLaunchConfigurations(Setting):
    """Restore what `PushLaunchConfigurations` saved last in this group or file."""


@dataclass(frozen=True)
class ResetLaunchConfigurations(Setting, element="reset"):
    """Forget all arguments, except for these, and the namespace, parameters and remappings."""

    launch_configurations: Mapping[str, Text] = option(
        {},
        "Arguments to keep, and their values, which are evaluated before the others are forgotten.",
        keys="keep",
    )


@dataclass(frozen=True)
class UnsetLaunchConfiguration(Setting):
    """Remove an argument. One that is not set stays so."""

    name: Text = field(metadata=required("The argument."))


@dataclass(frozen=True, kw_only=True)
class PushEnvironment(Setting):
    """Save the environment of programs, until `PopEnvironment`."""


@dataclass(frozen=True, kw_only=True)
class PopEnvironment(Setting):
    """Restore the environment that was saved last in this group or file."""


@dataclass(frozen=True, kw_only=True)
class ResetEnvironment(Setting, element="reset_env"):
    """Give programs the environment that they had at the beginning of the launch."""


@dataclass(frozen=True)
class SetParametersFromFile(Setting, element="set_parameters_from_file"):
    """Set the parameters of a YAML file for nodes; `SetParameter` and a node's own have precedence.

    Applies from here to the end of the group or file.
    """

    filename: Text = field(
        metadata=required(
            "A YAML file of parameters; a relative path starts at the folder of the launch file."
        )
    )


@dataclass(frozen=True)
class IncludeLaunchDescription(Action, element="include"):
    """Carry out another launch file in a scope of its own.

    It sees the arguments and variables that are set here.
    """

    launch_description_source: Text = field(
        metadata=required("The file; a relative path starts at the folder of this launch file.", keys="file")
    )
    _: KW_ONLY
    launch_arguments: Mapping[str, Text] | Iterable[tuple[str, Text]] = option(
        (), "Arguments for the file.", keys="arg let arguments"
    )
    scoped: bool = option(True, "Whether what the file sets ends with it.")

    @property
    def given(self) -> Iterable[tuple[str, Text]]:
        """The arguments in their order, as pairs."""
        given = cast("Any", self.launch_arguments)
        return cast("Iterable[tuple[str, Text]]", given.items() if isinstance(given, Mapping) else given)


@dataclass(frozen=True)
class TimerAction(Action, element="timer"):
    """Carry out actions later."""

    _: KW_ONLY
    period: float | Text = field(metadata=required("Seconds to wait.", unit="s"))
    actions: Sequence[Action] = field(
        metadata=required("The actions to carry out then.", keys="children actions")
    )
    cancel_on_shutdown: bool | Text = option(
        True,
        "Whether to forget them when the launch ends. Otherwise it ends after them; processes are not"
        " started any more.",
    )


@dataclass(frozen=True)
class Shutdown(Action, element="shutdown"):
    """End the launch."""

    _: KW_ONLY
    reason: Text = option("the launch file says so", "The reason to show.")


@dataclass(frozen=True, kw_only=True)
class EmitEvent(Action):
    """Cause an event: `ChangeState`, or ROS 2's form of `Shutdown`."""

    event: Shutdown | ChangeState = field(metadata=required("The ChangeState or Shutdown."))


@dataclass(frozen=True, kw_only=True)
class UnsupportedAction(Action):
    """An action of ROS 2 that callboard does not have. It can be in a branch that is not taken."""

    action_type: str = field(metadata=required("The name of the action."))
    remedy: str = field(metadata=required("What to do instead."))


COMPONENTS: Final = "components are C++ libraries; start each node with Node"
"""The remedy for actions that load components."""


@dataclass(frozen=True)
class OpaqueFunction(Action):
    """Call a function, and carry out the actions that it returns.

    It is called when the description is planned; in a timer or an event handler, when that is due.
    """

    _: KW_ONLY
    function: Callable[..., Any] = field(
        metadata=required(
            "Called with the `LaunchContext` and the arguments below; returns actions, or None."
        )
    )
    args: Iterable[Any] = option((), "Further arguments.")
    kwargs: Mapping[str, Any] = option({}, "Further arguments by name.")


@dataclass(frozen=True)
class RegisterEventHandler(Action):
    """React to something from here on, whenever it happens."""

    event_handler: EventHandler = field(metadata=required("What to react to, and how."))

    @property
    def actions(self) -> Sequence[Action]:
        """The actions of its reactions, as far as they are known before."""
        return self.event_handler.actions
