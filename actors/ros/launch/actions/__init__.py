"""Actions. Where ROS 2's have other arguments or defaults than callboard's, they are subclasses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from actors.launch import (
    AppendEnvironmentVariable as AppendEnvironmentVariable,
    DeclareLaunchArgument as DeclareLaunchArgument,
    ExecuteProcess as CallboardProcess,
    GroupAction as GroupAction,
    IncludeLaunchDescription as CallboardInclude,
    LogInfo as LogInfo,
    OpaqueFunction as OpaqueFunction,
    PopEnvironment as PopEnvironment,
    PopLaunchConfigurations as PopLaunchConfigurations,
    PushEnvironment as PushEnvironment,
    PushLaunchConfigurations as PushLaunchConfigurations,
    RegisterEventHandler as RegisterEventHandler,
    ResetEnvironment as ResetEnvironment,
    ResetLaunchConfigurations as ResetLaunchConfigurations,
    SetEnvironmentVariable as SetEnvironmentVariable,
    SetLaunchConfiguration as SetLaunchConfiguration,
    Shutdown as CallboardShutdown,
    TimerAction as CallboardTimer,
    UnsetEnvironmentVariable as UnsetEnvironmentVariable,
    UnsetLaunchConfiguration as UnsetLaunchConfiguration,
)
from actors.ros.launch.description import Action as RosAction
from actors.ros.launch.loops import (
    ForEach as ForEach,
    ForLoop as ForLoop,
)
from actors.ros.launch.unsupported import (
    EmitEvent as EmitEvent,
    unsupported_action,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from actors.launch import LaunchContext
    from actors.launch.description.action import Action
    from actors.launch.description.conditions import Condition
    from actors.launch.description.substitutions import Text
    from actors.ros.launch.descriptions import Executable

OpaqueCoroutine = unsupported_action("OpaqueCoroutine", "use OpaqueFunction")
UnregisterEventHandler = unsupported_action("UnregisterEventHandler", "give the handler handle_once=True")

_IGNORED: Final = ("output_format", "cached_output", "log_cmd")


def process_options(given: dict[str, Any]) -> dict[str, Any]:
    """Return callboard's options of a process for ROS 2's, with its defaults.

    Lines are labelled and logged as callboard does it, so `output_format`, `cached_output` and `log_cmd` have
    no meaning here.
    """
    options = {name: value for name, value in given.items() if name not in _IGNORED}
    options["output"] = _output(options.get("output") or "log")
    options.setdefault("respawn_backoff", 1.0)  # always the same delay
    return options


def _output(output: Text | Mapping[str, Any]) -> Text:
    """Return where lines go; of a mapping of streams, what shows at least as much."""
    if isinstance(output, Mapping):
        modes = {mode for each in output.values() for mode in ([each] if isinstance(each, str) else each)}
        return modes.pop() if len(modes) == 1 else "full" if "own_log" in modes else "both"
    return output


class ExecuteProcess(CallboardProcess):
    """Any program; its stdout goes to the log file alone, unless `output` says otherwise."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**process_options(given))


class ExecuteLocal(ExecuteProcess):
    """Any program.

    Args:
        process_description: The program.
    """

    def __init__(self, *, process_description: Executable, **given: Any) -> None:
        super().__init__(**process_description.options, **given)


class IncludeLaunchDescription(CallboardInclude):
    """Another launch file. As in ROS 2, what it sets applies after it, too.

    Args:
        launch_description_source: The file.
        launch_arguments: Arguments for it.
        condition: When to carry it out; None: always.
    """

    def __init__(
        self,
        launch_description_source: Text,
        *,
        launch_arguments: Mapping[str, Text] | Iterable[tuple[str, Text]] | None = None,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(
            launch_description_source,
            launch_arguments=launch_arguments or (),
            condition=condition,
            scoped=False,
        )


class ReplaceEnvironmentVariables(RosAction):
    """Give programs these environment variables and no others.

    Args:
        environment: The variables.
        given: The options of all actions, such as `condition`.
    """

    def __init__(self, environment: Mapping[Text, Text] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self._environment = environment or {}

    def execute(self, context: LaunchContext) -> list[Action]:
        """Return the actions that change the environment."""
        return [
            *map(UnsetEnvironmentVariable, context.environment),
            *(SetEnvironmentVariable(name, value) for name, value in self._environment.items()),
        ]


class TimerAction(CallboardTimer):
    """Carry out actions later.

    Args:
        period: Seconds to wait.
        actions: The actions.
        cancel_on_shutdown: Whether to forget them when the launch ends.
        condition: When to carry it out; None: always.
    """

    def __init__(
        self,
        *,
        period: float | Text,
        actions: Iterable[Action],
        cancel_on_shutdown: bool | Text = True,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(
            period=period,
            actions=_listed(actions),
            cancel_on_shutdown=cancel_on_shutdown,
            condition=condition,
        )


class Shutdown(CallboardShutdown):
    """End the launch.

    Args:
        reason: The reason to show.
        condition: When to carry it out; None: always.
    """

    def __init__(
        self, *, reason: Text = "reason not given", condition: Condition | None = None, **ignored: Any
    ) -> None:
        super().__init__(reason=reason, condition=condition)


def _listed(actions: Iterable[Action]) -> Sequence[Action]:
    return actions if isinstance(actions, list | tuple) else list(actions)
