"""Substitutions about packages and parameters."""

from __future__ import annotations

from actors.launch import (
    ExecutableInPackage as ExecutableInPackage,
    FindPackagePrefix as CallboardPrefix,
    FindPackageShare as CallboardShare,
    Parameter as Parameter,
)
from actors.ros.launch.library import ros_files


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
