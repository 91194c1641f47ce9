"""Packages of the index, and Python packages."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from actors.ros.ament_index_python.resources import get_resources
from actors.tools.executables import DataPackage, find_package
from actors.tools.prefixes import PACKAGES

if TYPE_CHECKING:
    from actors.tools.executables import Package


class PackageNotFoundError(KeyError):
    """There is no such package."""


def get_packages_with_prefixes() -> dict[str, str]:
    """Return the names of the packages in the index, and the folders that they are installed in."""
    return get_resources(PACKAGES)


def get_package_prefix(package_name: str) -> str:
    """Return the folder that a package is installed in.

    Raises:
        PackageNotFoundError: There is no such package.
    """
    return str(_package(package_name).prefix())


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:
    """Return the folder with a package's data.

    Raises:
        PackageNotFoundError: There is no such package.
    """
    package = _package(package_name)
    return package.share() or package.prefix() / "share" / package_name


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """Return the folder with a package's data.

    Raises:
        PackageNotFoundError: There is no such package.
    """
    return str(get_package_share_path(package_name))


def _package(name: str) -> Package:
    found = find_package(name)
    if found is None and (prefix := get_packages_with_prefixes().get(name)):
        return DataPackage(Path(prefix), name)  # one of callboard's own
    if found is None:
        raise PackageNotFoundError(
            f"No package '{name}' is installed, in this Python or in AMENT_PREFIX_PATH"
        )
    return found
