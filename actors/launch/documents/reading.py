"""Reading: the description that a YAML, TOML or XML file gives."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Final, cast

from actors.launch.description.description import LaunchDescription
from actors.launch.documents.elements import Elements
from actors.launch.documents.errors import DocumentError, Spot
from actors.launch.documents.kinds import read_fields
from actors.launch.documents.parsing import toml_data, yaml_data, yaml_line
from actors.launch.documents.xml_parsing import XmlDocument
from actors.launch.errors import LaunchFileError

if TYPE_CHECKING:
    from actors.launch.description.action import Action

XML_SUFFIXES: Final = (".xml", ".launch")


def read_document(path: str, source: bytes) -> LaunchDescription:
    """Return what a file describes; its suffix says whether that is TOML or XML; else it is YAML.

    Args:
        path: Its path.
        source: What is in it.

    Raises:
        LaunchFileError: Something in it is not as it should be; the text says what, and where.
    """
    suffix = PurePath(path).suffix

    def place(spot: Spot, line: int | None = None) -> str:
        if line is None and spot.steps and suffix != ".toml":
            line = XmlDocument(source).line(spot) if suffix in XML_SUFFIXES else yaml_line(source, spot)
        where = path if line is None else f"{path}, line {line}"
        return f"{where}: {spot}" if spot.steps else where

    try:
        if suffix in XML_SUFFIXES:
            data: object = XmlDocument(source).data
        else:
            data = toml_data(source) if suffix == ".toml" else yaml_data(source)
        actions = _actions(data, Spot(describe=place))
    except DocumentError as error:
        raise LaunchFileError(f"{place(error.spot, error.line)}: {error.text}") from None
    return LaunchDescription(actions, file=path)


def _actions(data: object, spot: Spot) -> tuple[Action, ...]:
    if not isinstance(data, dict):
        raise spot.error("a launch file begins with 'launch:' and a list of elements")
    return Elements().read(
        read_fields(cast("object", data), spot, ("launch",))["launch"], spot.inner("launch")
    )
