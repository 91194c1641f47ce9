"""Resources of the index."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - as in ROS 2, annotations can be read

from actors.regular_files import read_regular_text
from actors.ros.ament_index_python.search_paths import search_folders
from actors.tools.prefixes import INDEX


class InvalidResourceTypeNameError(ValueError):
    """A text cannot be the name of a type of resources."""


class InvalidResourceNameError(ValueError):
    """A text cannot be the name of a resource."""


def get_resource(resource_type: str, resource_name: str) -> tuple[str, str]:
    """Return what a resource holds, and the folder that it is installed in.

    Raises:
        LookupError: There is none.
        InvalidResourceTypeNameError: There can be no such type.
        InvalidResourceNameError: There can be no such name.
    """
    path = get_resource_path(resource_type, resource_name)
    return read_regular_text(path), str(path.parents[len(INDEX.parts) + 1])


def get_resource_path(resource_type: str, resource_name: str) -> Path:
    """Return the file of a resource.

    Raises:
        LookupError: There is none.
        InvalidResourceTypeNameError: There can be no such type.
        InvalidResourceNameError: There can be no such name.
    """
    _check(resource_type, resource_name)
    prefix = _prefix(resource_type, resource_name)
    if prefix is None:
        raise LookupError(
            f"No resource '{resource_name}' of type '{resource_type}' in any of: "
            f"{', '.join(map(str, search_folders()))}"
        )
    return prefix / INDEX / resource_type / resource_name


def get_resources(resource_type: str) -> dict[str, str]:
    """Return the names of the resources of a type, and the folders that they are installed in.

    Raises:
        InvalidResourceTypeNameError: There can be no such type.
    """
    _check_type(resource_type)
    found: dict[str, str] = {}
    for prefix in search_folders():
        folder = prefix / INDEX / resource_type
        for each in sorted(folder.iterdir()) if folder.is_dir() else ():
            if each.is_file() and not each.name.startswith("."):
                found.setdefault(each.name, str(prefix))
    return found


def get_resource_types() -> set[str]:
    """Return the types of resources that there are."""
    folders = [each / INDEX for each in search_folders() if (each / INDEX).is_dir()]
    return {each.name for folder in folders for each in folder.iterdir() if each.is_dir()}


def has_resource(resource_type: str, resource_name: str) -> str | bool:
    """Return the folder that a resource is installed in; False if there is none.

    Raises:
        InvalidResourceTypeNameError: There can be no such type.
        InvalidResourceNameError: There can be no such name.
    """
    _check(resource_type, resource_name)
    found = _prefix(resource_type, resource_name)
    return False if found is None else str(found)


def _prefix(resource_type: str, name: str) -> Path | None:
    return next((each for each in search_folders() if (each / INDEX / resource_type / name).is_file()), None)


def _check(resource_type: str, resource_name: str) -> None:
    _check_type(resource_type)
    if not _is_name(resource_name):
        raise InvalidResourceNameError(f"'{resource_name}' cannot be the name of a resource")


def _check_type(name: str) -> None:
    if not _is_name(name):
        raise InvalidResourceTypeNameError(f"'{name}' cannot be a type of resources")


def _is_name(text: str) -> bool:
    return bool(text) and not {"/", "\\"} & set(text) and text not in {".", ".."}
