"""Actions: what a launch file can ask for, as data.

Each takes a `condition`; without one it always takes place. What they mean together is the plan's to say.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, cast

from actors.launch.description.action import Action, Setting
from actors.launch.description.substitutions import Text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.launch.description.action import EventHandler
    from actors.launch.description.lifecycle import ChangeState
    from actors.launch.description.process_actions import ParameterEntry


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


@dataclass(frozen=True, kw_only=True)
class PushLaunchConfigurations(Setting):
    """Save the arguments and their values, until `PopLaunchConfigurations`.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True, kw_only=True)
class PopLaunchConfigurations(Setting):
    """Restore the arguments that were saved last in this group or file.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True)
class ResetLaunchConfigurations(Setting):
    """Forget all arguments, except for these.

    Attributes:
        launch_configurations: Arguments and their values. They are evaluated before the others are forgotten.
        condition: When to carry it out; None: always.
    """

    launch_configurations: Mapping[str, Text] = field(default_factory=dict[str, Text])


@dataclass(frozen=True)
class UnsetLaunchConfiguration(Setting):
    """Remove an argument. One that is not set stays so.

    Attributes:
        name: The argument.
        condition: When to carry it out; None: always.
    """

    name: Text


@dataclass(frozen=True, kw_only=True)
class PushEnvironment(Setting):
    """Save the environment of programs, until `PopEnvironment`.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True, kw_only=True)
class PopEnvironment(Setting):
    """Restore the environment that was saved last in this group or file.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True, kw_only=True)
class ResetEnvironment(Setting):
    """Give programs the environment that they had at the beginning of the launch.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True)
class SetParametersFromFile(Setting):
    """Set the parameters of a YAML file for nodes; `SetParameter` and a node's own have precedence.

    Applies from here to the end of the group or file.

    Attributes:
        filename: The file; a relative path starts at the folder of the launch file.
        condition: When to carry it out; None: always.
    """

    filename: Text


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
