"""Reads the description from a YAML, TOML or XML file."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Final, cast

from actors.launch.description.description import LaunchDescription
from actors.launch.documents.elements import Elements
from actors.launch.documents.errors import DocumentError, Location
from actors.launch.documents.kinds import read_fields
from actors.launch.documents.parsing import toml_data, yaml_data, yaml_line
from actors.launch.documents.xml_parsing import XmlDocument
from actors.launch.errors import LaunchFileError

if TYPE_CHECKING:
    from actors.launch.description.action import Action

XML_SUFFIXES: Final = (".xml", ".launch")


def read_document(path: str, source: bytes) -> LaunchDescription:
    """Return the description in a launch file. Its suffix tells TOML and XML; others are YAML.

    Args:
        path: The path of the file.
        source: Its content.

    Raises:
        LaunchFileError: It is malformed; the text says what is wrong, and in which line.
    """
    suffix = PurePath(path).suffix  # the content could not tell: most TOML and XML is a string in YAML

    def describe(location: Location, line: int | None = None) -> str:
        # Parsed a second time, because data keeps no lines; this happens for errors only. tomllib has no
        # lines.
        if line is None and location.path and suffix != ".toml":
            line = (
                XmlDocument(source).line(location) if suffix in XML_SUFFIXES else yaml_line(source, location)
            )
        where = path if line is None else f"{path}, line {line}"
        return f"{where}: {location}" if location.path else where

    try:
        if suffix in XML_SUFFIXES:
            data: object = XmlDocument(source).data
        else:
            data = toml_data(source) if suffix == ".toml" else yaml_data(source)
        actions = _actions(data, Location(formatter=describe))
    except DocumentError as error:
        raise LaunchFileError(f"{describe(error.location, error.line)}: {error.text}") from None
    return LaunchDescription(actions, file=path)


def _actions(data: object, location: Location) -> tuple[Action, ...]:
    if not isinstance(data, dict):
        # An empty file, a bare list, or another kind of file.
        raise location.error("a launch file begins with 'launch:' and a list of elements")
    return Elements().read(
        read_fields(cast("object", data), location, ("launch",))["launch"], location.inner("launch")
    )
