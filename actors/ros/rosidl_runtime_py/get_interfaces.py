"""Interfaces of installed packages: their names, and the files that define them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from actors.ros.ament_index_python.resources import get_resource, get_resources, has_resource
from actors.ros.interface_resources import INTERFACES
from actors.tools.prefixes import PACKAGES

if TYPE_CHECKING:
    from collections.abc import Iterable

_MIN_PARTS = 2
"""Of the name of an interface: its package, and a file in its share folder."""


def get_interface_packages() -> dict[str, str]:
    """Return the names of packages with interfaces, and the folders that they are installed in."""
    return get_resources(INTERFACES)


def get_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """Return the interfaces of packages that have any, such as {"std_msgs": ["msg/String"]}.

    Args:
        package_names: The packages; all if there are none.

    Raises:
        LookupError: There is no such package.
    """
    return _interfaces(package_names, ("msg", "srv", "action"))


def get_message_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """Return the messages of packages; as for `get_interfaces`.

    Raises:
        LookupError: There is no such package.
    """
    return _interfaces(package_names, ("msg",))


def get_service_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """Return the services of packages; as for `get_interfaces`.

    Raises:
        LookupError: There is no such package.
    """
    return _interfaces(package_names, ("srv",))


def get_action_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """Return the actions of packages; as for `get_interfaces`.

    Raises:
        LookupError: There is no such package.
    """
    return _interfaces(package_names, ("action",))


def get_interface_path(interface_name: str) -> str:
    """Return the file that defines an interface.

    Args:
        interface_name: Such as "std_msgs/msg/String" or "std_msgs/msg/String.msg".

    Raises:
        ValueError: This is no such name.
        LookupError: There is no such package, or it has no such file.
    """
    parts = interface_name.split("/")
    if len(parts) < _MIN_PARTS or not all(parts) or ".." in parts:
        raise ValueError(
            f"Expected the name of an interface, such as std_msgs/msg/String; got '{interface_name}'"
        )
    prefix = has_resource(PACKAGES, parts[0])
    if not prefix:
        raise LookupError(f"Unknown package '{parts[0]}'")
    path = Path(str(prefix), "share", interface_name)
    files = [path] if "." in parts[-1] else [path.with_suffix(f".{end}") for end in (parts[-2], "idl")]
    found = next((each for each in files if each.exists()), None)
    if found is None:
        raise LookupError(f"The package '{parts[0]}' has no interface '{files[0]}'")
    return str(found)


def _interfaces(packages: Iterable[str], kinds: tuple[str, ...]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for package in list(packages) or get_interface_packages():
        if not has_resource(PACKAGES, package):
            raise LookupError(f"Unknown package '{package}'")
        if not has_resource(INTERFACES, package):
            continue
        lines = get_resource(INTERFACES, package)[0].splitlines()
        ends = {(f"{kind}/", end) for kind in kinds for end in ("idl", kind)}
        names = {  # once for each type: a build lists two files. With "_": parts of services and actions
            name: None
            for name, _, suffix in (each.rpartition(".") for each in lines)
            if "_" not in name and (name[: name.find("/") + 1], suffix) in ends
        }
        if names:
            found[package] = list(names)
    return found
