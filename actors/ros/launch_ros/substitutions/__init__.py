"""Substitutions about packages and parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch import (
    ExecutableInPackage as ExecutableInPackage,
    FindPackagePrefix as CallboardPrefix,
    FindPackageShare as CallboardShare,
    LaunchError,
)
from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.documents.errors import DocumentError
from actors.launch.documents.parsing import yaml_data
from actors.ros.launch.library import ros_files

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Scope, Text


class FindPackagePrefix(CallboardPrefix):
    """The folder of the environment that a package is installed in.

    Args:
        package: The package's name.
    """

    def find(self, package_name: str) -> str:
        """Return it at once.

        Raises:
            LaunchError: There is no such package.
        """
        return ros_files().prefix(package_name)


FindPackage = FindPackagePrefix


class FindPackageShare(CallboardShare):
    """The folder of a package's data, such as `launch`.

    Args:
        package: The package's name.
    """

    def find(self, package_name: str) -> str:
        """Return it at once.

        Raises:
            LaunchError: There is no such package.
        """
        return ros_files().share(package_name)


class Parameter(Substitution):
    """The value of a parameter that `SetParameter` has set for all nodes.

    Args:
        name: The parameter.
        default: Its value if it is not set; None: that is an error.
    """

    def __init__(self, name: Text, *, default: Text | None = None) -> None:
        self._name, self._default = name, default

    def perform(self, scope: Scope) -> str:
        """Return it.

        Raises:
            LaunchError: It is not set, and there is no default.
        """
        name = resolve(self._name, scope)
        if name in scope.parameters:
            return _plain(scope.parameters[name])
        if self._default is None:
            raise LaunchError(f"No parameter '{name}' has been set for all nodes")
        return resolve(self._default, scope)


def _plain(text: str) -> str:
    """Return the text that YAML means; a number or a truth value as it is written."""
    try:
        value = yaml_data(text.encode())
    except DocumentError:
        return text
    return value if isinstance(value, str) else text
