"""Settings: what an action sets in the scope that it stands in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch.actions import (
    AppendEnvironmentVariable,
    PushNamespace,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
    SetParameter,
    SetRemap,
    UnsetEnvironmentVariable,
)
from actors.launch.conditions import truth
from actors.launch.errors import LaunchError
from actors.launch.namespaces import prefix_namespace
from actors.launch.ros_arguments import parameter_texts
from actors.launch.substitutions import resolve

if TYPE_CHECKING:
    from actors.launch.actions import Setting
    from actors.launch.substitutions import Scope


def apply_setting(action: Setting, scope: Scope) -> None:
    """Set it.

    Raises:
        LaunchError: A text stands for nothing there, or a value cannot be one.
    """
    match action:
        case PushNamespace():
            scope.namespace = prefix_namespace(scope.namespace, resolve(action.namespace, scope))
        case SetLaunchConfiguration():
            scope.configurations[resolve(action.name, scope)] = resolve(action.value, scope)
        case SetEnvironmentVariable():
            scope.environment[resolve(action.name, scope)] = resolve(action.value, scope)
        case UnsetEnvironmentVariable():
            scope.environment.pop(resolve(action.name, scope), None)
        case AppendEnvironmentVariable():
            _append(action, scope)
        case SetParameter():
            scope.parameters.update(parameter_texts({action.name: action.value}, scope))
        case SetRemap():
            scope.remappings.append((resolve(action.src, scope), resolve(action.dst, scope)))
        case _:
            raise LaunchError(f"{type(action).__name__} is no action that can be carried out")


def _append(action: AppendEnvironmentVariable, scope: Scope) -> None:
    name = resolve(action.name, scope)
    parts = [scope.environment.get(name), resolve(action.value, scope)]
    if truth(action.prepend, scope):
        parts.reverse()
    scope.environment[name] = resolve(action.separator, scope).join(each for each in parts if each)
