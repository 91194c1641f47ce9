"""The index of packages, and interface packages in it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ament_index_python import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_packages_with_prefixes,
    get_resource,
    get_resources,
    has_resource,
)

os.environ["AMENT_PREFIX_PATH"] = sys.prefix  # as ROS 2's setup script does; without it, there is no index
PACKAGES = ("builtin_interfaces", "action_msgs", "geometry_msgs", "std_msgs", "std_srvs")


def interface_packages():
    """Return whether they are resources, and packages in the same folder."""
    interfaces, packages = get_resources("rosidl_interfaces"), get_packages_with_prefixes()
    return {
        name: (
            interfaces[name] == packages[name] == get_package_prefix(name),
            has_resource("rosidl_interfaces", name) == interfaces[name],
        )
        for name in PACKAGES
    }


def interface_files():
    """Return the files that a resource lists, without those that a build makes."""
    return {
        name: [
            each for each in get_resource("rosidl_interfaces", name)[0].split() if not each.endswith(".idl")
        ]
        for name in PACKAGES
    }


def definitions():
    """Return the words of definitions in share folders, without comments and their own package."""
    found = {}
    for package, path in (
        ("std_msgs", "msg/Header.msg"),
        ("std_srvs", "srv/SetBool.srv"),
        ("geometry_msgs", "msg/PoseStamped.msg"),
    ):
        text = (
            Path(get_package_share_directory(package), path)
            .read_text(encoding="utf-8")
            .replace(f"{package}/", "")
        )
        found[path] = [line.partition("#")[0].split() for line in text.splitlines()]
    return {path: [words for words in lines if words] for path, lines in found.items()}


def unknown_names():
    """Return what functions raise for names that do not exist."""
    found = {"has": has_resource("rosidl_interfaces", "no_such_msgs")}
    for function in (get_package_prefix, get_package_share_directory):
        try:
            found[function.__name__] = function("no_such_msgs")
        except PackageNotFoundError as error:
            found[function.__name__] = isinstance(error, KeyError)
    try:
        get_resource("rosidl_interfaces", "no_such_msgs")
    except LookupError:
        found["get"] = "LookupError"
    return found
