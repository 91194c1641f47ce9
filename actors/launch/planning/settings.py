"""Settings: actions that change the scope for the actions after them."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, TypeVar

from actors.launch.description.actions import (
    AppendEnvironmentVariable,
    PopEnvironment,
    PopLaunchConfigurations,
    PushEnvironment,
    PushLaunchConfigurations,
    PushNamespace,
    ResetEnvironment,
    ResetLaunchConfigurations,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
    SetParameter,
    SetParametersFromFile,
    SetRemap,
    UnsetEnvironmentVariable,
    UnsetLaunchConfiguration,
)
from actors.launch.description.conditions import to_bool
from actors.launch.description.substitutions import resolve
from actors.launch.errors import LaunchError
from actors.launch.planning.namespaces import prefix_namespace
from actors.launch.planning.node_arguments import parameter_texts
from proto.untrusted_text import escape
from proto.wire.names import normalize_namespace, validate_namespace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.launch.description.action import Setting
    from actors.launch.description.substitutions import Scope, Text

T = TypeVar("T")


def apply_setting(action: Setting, scope: Scope) -> None:
    """Change a scope as a setting says.

    Raises:
        LaunchError: A substitution has no value in the scope, or a value is not valid.
        InvalidNamespaceError: A namespace is not valid.
    """
    match action:
        case PushNamespace():
            scope.namespace = prefix_namespace(scope.namespace, resolve(action.namespace, scope))
            validate_namespace(normalize_namespace(scope.namespace or ""))
        case SetLaunchConfiguration():
            scope.configurations[resolve(action.name, scope)] = resolve(action.value, scope)
        case SetEnvironmentVariable():
            # Of the programs only: changing os.environ would change the launch itself.
            scope.environment.update(variables({resolve(action.name, scope): action.value}, scope))
        case UnsetEnvironmentVariable():
            scope.environment.pop(resolve(action.name, scope), None)
        case AppendEnvironmentVariable():
            _append(action, scope)
        case SetParameter():
            scope.parameters.update(parameter_texts({action.name: action.value}, scope))
        case SetRemap():
            # In order: the first rule that matches a name counts.
            scope.remappings.append((resolve(action.src, scope), resolve(action.dst, scope)))
        case SetParametersFromFile():
            path = str(PurePath(scope.folder, resolve(action.filename, scope)))
            scope.parameter_files.append(scope.library.parameter_file(path))
        case _:
            _save_or_restore(action, scope)


def _save_or_restore(action: Setting, scope: Scope) -> None:
    match action:
        case PushLaunchConfigurations():
            scope.saved_configurations.append(scope.inner())
        case PopLaunchConfigurations():
            scope.restore(_last(action, scope.saved_configurations))
        case ResetLaunchConfigurations():
            # Evaluated first: the values may use the arguments that are forgotten.
            given = {name: resolve(value, scope) for name, value in action.launch_configurations.items()}
            scope.restore(scope.initial())
            scope.configurations.update(given)
        case UnsetLaunchConfiguration():
            scope.configurations.pop(resolve(action.name, scope), None)
        case PushEnvironment():
            scope.saved_environments.append(dict(scope.environment))
        case PopEnvironment():
            scope.environment = _last(action, scope.saved_environments)
        case ResetEnvironment():
            scope.environment = dict(scope.first_environment)
        case _:
            raise LaunchError(f"{type(action).__name__} is not an action that can be carried out")


def _last(action: Setting, saved: list[T]) -> T:
    # A scope begins with empty stacks, so that a group cannot pop what was pushed outside of it.
    if not saved:
        raise LaunchError(f"{type(action).__name__}: nothing has been pushed in this group or file")
    return saved.pop()


def variables(given: Mapping[str, Text], scope: Scope) -> dict[str, str]:
    """Return environment variables and their values.

    Raises:
        LaunchError: A substitution has no value in the scope, or the name or value is not valid.
    """
    found = {name: resolve(value, scope) for name, value in given.items()}
    # The start of each process would fail with an error that does not name the action.
    for name, value in found.items():
        if not name or "=" in name or "\0" in name + value:
            raise LaunchError(f"There can be no environment variable '{escape(f'{name}={value}')}'")
    return found


def _append(action: AppendEnvironmentVariable, scope: Scope) -> None:
    name = resolve(action.name, scope)
    parts = [scope.environment.get(name), resolve(action.value, scope)]
    if to_bool(action.prepend, scope):
        parts.reverse()
    value = resolve(action.separator, scope).join(each for each in parts if each)
    scope.environment.update(variables({name: value}, scope))
