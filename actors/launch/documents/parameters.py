"""Parameters of nodes in launch documents: by name, from files, and in ROS 2's form.

parameters: {speed: 1.5, limits: {low: 0, high: $(var high)}}       by name; a dot is one level
parameters: [common.yaml, {speed: 1.5}]                             files, too; the last value counts
param: [{from: common.yaml}, {name: speed, value: 1.5}]             ROS 2's form
param: [{from: common.yaml, allow_substs: true}]                    with $(var …) in the file
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.yaml_reader import PlainText
from actors.interfaces.yaml_scalars import launch_scalar
from actors.launch.description.process_actions import ParameterValue
from actors.launch.description.templates import ParameterFile
from actors.launch.documents import kinds
from actors.launch.documents.parsing import WrittenFloat, WrittenInt

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.launch.documents.errors import Location


_LISTS: Final[dict[Any, Any]] = {str: list[str], int: list[int], float: list[float], bool: list[bool]}
_TYPES: Final[dict[str, Any]] = {
    **{kind.__name__: kind for kind in _LISTS},
    **{f"list_of_{kind.__name__}": listed for kind, listed in _LISTS.items()},
}


class ParameterKind(kinds.Kind):
    """One parameter's value."""

    def read(self, value: object, location: Location) -> Any:
        return (
            _single(value, location) if not isinstance(value, list) else _list(cast("Any", value), location)
        )

    def schema(self) -> kinds.Schema:
        return {"anyOf": [kinds.SCALAR, {"type": "array", "items": kinds.SCALAR}]}


class ParametersKind(kinds.Kind):
    """Parameters by name, the path of a file of them, or a list of such mappings and paths."""

    def read(self, value: object, location: Location) -> tuple[Any, ...]:
        if not isinstance(value, list):
            return (self._entry(value, location),)
        return kinds.read_each(cast("object", value), location, self._entry)

    def _entry(self, value: object, location: Location) -> Any:
        return (
            _by_name(cast("object", value), location)
            if isinstance(value, dict)
            else kinds.read_text(value, location)
        )

    def schema(self) -> kinds.Schema:
        entry = {"anyOf": [{"$ref": "#/definitions/text"}, {"$ref": "#/definitions/parameters"}]}
        return {"anyOf": [*entry["anyOf"], {"type": "array", "items": entry}]}


class RosParametersKind(kinds.Kind):
    """ROS 2's list: of `{name, value}`, also with `type`, `{name, param: [more of them]}`, `{from: path}`."""

    def read(self, value: object, location: Location) -> tuple[Any, ...]:
        return kinds.read_each(value, location, self._entry)

    def _entry(self, value: object, location: Location) -> Any:
        if "from" in kinds.read_mapping(value, location):
            return self._file(value, location)
        return dict(self._named("", value, location))

    def _file(self, value: object, location: Location) -> Any:
        optional = [name for name in ("allow_substs",) if name in kinds.read_mapping(value, location)]
        found = kinds.read_fields(value, location, ("from", *optional))
        path = kinds.read_text(found["from"], location.inner("from"))
        if not optional:
            return path
        return ParameterFile(
            path, allow_substs=kinds.FLAG.read(found["allow_substs"], location.inner("allow_substs"))
        )

    def _named(self, prefix: str, value: object, location: Location) -> Iterator[tuple[str, Any]]:
        given = kinds.read_mapping(value, location)
        what = "param" if "param" in given else "value"
        typed = ("type",) if what == "value" and "type" in given else ()
        found = kinds.read_fields(value, location, ("name", what, *typed))
        name = prefix + kinds.read_name(found["name"], location.inner("name"))
        below = location.inner(what)
        if typed:
            kind = _type(found["type"], location.inner("type"))
            given_value = found[what]
            # A string is what is written, also `1.10` or `010`.
            read = kinds.read_text if kind in {str, list[str]} else _single
            if isinstance(given_value, list):
                typed_value: Any = _list(cast("Any", given_value), below, read)
                kind = _LISTS.get(kind, kind)
            else:
                typed_value = read(given_value, below)
            yield name, ParameterValue(typed_value, value_type=kind)
            return
        if what == "value":
            yield name, ParameterKind().read(found[what], below)
            return
        for at, each in enumerate(kinds.read_list(found[what], below)):
            yield from self._named(f"{name}.", each, below.inner(at))

    def schema(self) -> kinds.Schema:
        file = kinds.record_schema({"from": {"$ref": "#/definitions/text"}}, allow_substs=kinds.FLAG.schema())
        return {"type": "array", "items": {"anyOf": [{"$ref": "#/definitions/parameter"}, file]}}


def definitions() -> dict[str, kinds.Schema]:
    """Return the schemas that the ones here refer to."""
    name = {"$ref": "#/definitions/name"}
    value = ParameterKind().schema()
    below = {"type": "array", "items": {"$ref": "#/definitions/parameter"}}
    alone = kinds.record_schema({"name": name, "value": value})
    typed = kinds.record_schema({"name": name, "value": value, "type": {"enum": list(_TYPES)}})
    group = kinds.record_schema({"name": name, "param": below})
    return {
        "parameter": {"anyOf": [alone, typed, group]},
        "parameters": {
            "type": "object",
            "propertyNames": kinds.NAMES,
            "additionalProperties": {"anyOf": [*value["anyOf"], {"$ref": "#/definitions/parameters"}]},
        },
    }


def _by_name(value: object, location: Location) -> dict[str, Any]:
    return {
        kinds.read_name(name, location.inner(name)): _by_name(cast("object", each), location.inner(name))
        if isinstance(each, dict)
        else ParameterKind().read(each, location.inner(name))
        for name, each in kinds.read_mapping(value, location).items()
    }


def _type(value: object, location: Location) -> Any:
    kind = _TYPES.get(value) if isinstance(value, str) else None
    if kind is None:
        raise location.error(f"expected one of {', '.join(_TYPES)}")
    return kind


def _single(value: object, location: Location) -> Any:
    """Return a value; what is a string to YAML may be a number to nodes."""
    if isinstance(value, WrittenInt | WrittenFloat):
        return int(value) if isinstance(value, WrittenInt) else float(value)
    if isinstance(value, bool | int | float):
        return value
    text = kinds.read_text(value, location)
    return launch_scalar(text) if isinstance(value, PlainText) and isinstance(text, str) else text


def _list(values: object, location: Location, read: Callable[[object, Location], Any] = _single) -> list[Any]:
    """Return a list of values. Each substitution is a list of its own: otherwise all would be one string."""
    found = kinds.read_each(values, location, read)
    return [each if isinstance(each, bool | int | float | str | tuple) else (each,) for each in found]
