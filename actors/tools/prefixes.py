"""Where packages of ROS 2 are installed: folders with `share/PACKAGE`, `lib/PACKAGE` and an index.

The index is `share/ament_index/resource_index/TYPE/NAME`: a file for each resource of a type. Each package is
a resource of the type "packages".
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from actors.config import environment
from actors.regular_files import read_regular

INDEX: Final = Path("share", "ament_index", "resource_index")
PACKAGES: Final = "packages"
"""The type of resource that packages are."""
MAX_SHEBANG: Final = 512
"""Bytes of a program's first line that are looked at."""


def prefixes() -> list[Path]:
    """Return the folders of AMENT_PREFIX_PATH, this Python's prefix, and those of `sys.path` that have it."""
    given = [Path(each) for each in environment.ament_prefixes()]
    target_folders = [Path(each) for each in sys.path if each and Path(each, INDEX).is_dir()]
    return [each for each in dict.fromkeys([*given, Path(sys.prefix), *target_folders]) if each.is_dir()]


def use_ros_interfaces(*folders: Path | str) -> None:
    """Let this process find the types of packages that are installed for ROS 2, by `find_interface`.

    Their classes are made from the `.msg`, `.srv`, `.action` and `.idl` files in `share`, without ROS 2's own
    Python packages. Types that callboard brings, or that others on the import path have, remain as they are.

    Args:
        folders: Prefixes, such as /opt/ros/kilted; if there is none, those of AMENT_PREFIX_PATH, and this
            Python's if packages of ROS 2 are installed in it.
    """
    given = [Path(each) for each in folders or environment.ament_prefixes()]
    indexed = [] if folders else [each for each in prefixes() if (each / INDEX).is_dir()]
    shares = [each / "share" for each in (*given, *indexed) if (each / "share").is_dir()]
    if shares:
        from actors.interfaces.share_packages import add_share_folders  # noqa: PLC0415 - seldom needed

        add_share_folders(shares)


def resource(kind: str, name: str) -> Path | None:
    """Return the folder in which there is a resource, or None.

    Args:
        kind: Its type.
        name: Its name.
    """
    return next((each for each in prefixes() if (each / INDEX / kind / name).is_file()), None)


def package_prefix(name: str) -> Path | None:
    """Return the folder that a package is installed in; None if it is no package of ROS 2's.

    Args:
        name: The package's name.
    """
    if not name or Path(name).name != name:
        return None
    shared = (each for each in prefixes() if (each / "share" / name / "package.xml").is_file())
    return resource(PACKAGES, name) or next(shared, None)


def python_programs(prefix: Path, package: str) -> dict[str, Path]:
    """Return the Python programs in a package's `lib` folder, by name.

    Args:
        prefix: The folder that the package is installed in.
        package: The package's name.
    """
    folder = prefix / "lib" / package
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    return {each.name: each for each in files if is_python_program(each)}


def is_python_program(path: Path) -> bool:
    """Return whether Python runs a file, by its name or its first line.

    Args:
        path: The file; it need not exist.
    """
    try:
        first = read_regular(path, MAX_SHEBANG).partition(b"\n")[0]
    except OSError:
        return False
    return path.suffix == ".py" or (first.startswith(b"#!") and b"python" in first)
