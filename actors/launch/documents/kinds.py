"""The kinds of values in launch documents: how they are read, and their JSON schemas."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar, cast

from actors.launch.description.templates import template, words
from actors.launch.documents.parsing import WrittenFloat, WrittenInt
from actors.launch.errors import LaunchError
from actors.tools.suggestions import did_you_mean
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actors.launch.description.substitutions import Text
    from actors.launch.documents.errors import Location

T = TypeVar("T")
Schema: TypeAlias = dict[str, Any]

SCALAR: Final[Schema] = {"type": ["string", "number", "boolean"]}
"""Values that are read as strings."""


NAMES: Final[Schema] = {"not": {"pattern": r"\$\("}}
"""Keys of a mapping that are names."""
NAME: Final[Schema] = {**SCALAR, "not": {"type": "string", "pattern": r"\$\("}}
"""Names elsewhere."""


class Kind(ABC):
    """A kind of value.

    All that its schema allows can be read, except malformed `$(…)`, so that editors propose nothing wrong.
    """

    @abstractmethod
    def read(self, value: object, location: Location) -> Any:
        """Return the value for the action.

        Raises:
            DocumentError: It is not a value of this kind.
        """

    @abstractmethod
    def schema(self) -> Schema:
        """Return its JSON schema."""


@dataclass(frozen=True)
class SimpleKind(Kind):
    """A kind of value without options.

    Attributes:
        reader: Reads it.
        pattern: Its JSON schema.
    """

    reader: Callable[[object, Location], Any]
    pattern: Schema

    def read(self, value: object, location: Location) -> Any:
        return self.reader(value, location)

    def schema(self) -> Schema:
        return self.pattern


@dataclass(frozen=True)
class OneOf(Kind):
    """One of a few words, or a string with `$(…)`."""

    choices: Sequence[str]

    def read(self, value: object, location: Location) -> Text:
        text = read_text(value, location)
        # With substitutions the value is checked when it is planned.
        if isinstance(text, str) and text not in self.choices:
            hint = did_you_mean(text, self.choices) or f"; it can be {', '.join(self.choices)}"
            raise location.error(f"it cannot be '{escape(text)}'{hint}")
        return text

    def schema(self) -> Schema:
        return {"anyOf": [{"enum": list(self.choices)}, {"type": "string", "pattern": r"\$\("}]}


@dataclass(frozen=True)
class BoundedNumber(Kind):
    """A number, or a string that contains one.

    Attributes:
        least: The lowest value.
        whole: Whether it must be an integer.
    """

    least: float
    whole: bool = False

    def read(self, value: object, location: Location) -> float | Text:
        # A string may have substitutions, so its number is checked when it is planned.
        if isinstance(value, str):
            return read_text(value, location)
        good = isinstance(value, int | float) and not isinstance(value, bool) and value >= self.least
        if not good or (self.whole and float(cast("float", value)) % 1):
            number = "a whole number" if self.whole else "a number"
            raise location.error(f"expected {number}, {self.least:g} or more, not {_describe(value)}")
        return int(cast("float", value)) if self.whole else float(cast("float", value))

    def schema(self) -> Schema:
        number: Schema = {"type": "integer" if self.whole else "number", "minimum": self.least}
        return {"anyOf": [number, {"type": "string"}]}


@dataclass(frozen=True)
class Texts(Kind):
    """A list of strings.

    Attributes:
        split: Whether a single string is split into words, as in a shell; otherwise it is a list of one.
        least: The lowest number of strings.
    """

    split: bool = False
    least: int = 0

    def read(self, value: object, location: Location) -> tuple[Text, ...]:
        if isinstance(value, list):
            found = read_each(cast("object", value), location, read_text)
        elif self.split:  # before substitutions are evaluated: a path with spaces stays one word
            found = _words(read_plain(value, location), location)
        elif self.least and isinstance(value, str) and not value.strip():
            found = ()
        else:
            found = (read_text(value, location),)
        if len(found) < self.least:
            raise location.error("it is empty")
        return found

    def schema(self) -> Schema:
        listed: Schema = {"type": "array", "items": {"$ref": "#/definitions/text"}}
        alone: Schema = {"$ref": "#/definitions/text"}
        if self.least:
            listed["minItems"] = self.least
            alone = {**SCALAR, "pattern": r"\S"}
        return {"anyOf": [alone, listed]}


class Choices(Kind):
    """A list of plain strings, or ROS 2's list of `value: STRING`."""

    def read(self, value: object, location: Location) -> tuple[str, ...]:
        return read_each(value, location, self._choice)

    def _choice(self, value: object, location: Location) -> str:
        if not isinstance(value, dict):
            return read_plain(value, location)
        return read_plain(
            read_fields(cast("object", value), location, ("value",))["value"], location.inner("value")
        )

    def schema(self) -> Schema:
        plain = {"$ref": "#/definitions/plain"}
        return {"type": "array", "items": {"anyOf": [plain, record_schema({"value": plain})]}}


@dataclass(frozen=True)
class Pairs(Kind):
    """Pairs of strings: a mapping, or ROS 2's list of pairs such as `{from: chatter, to: news}`.

    Attributes:
        first: The key of the first string in such a list.
        second: The key of the second.
    """

    first: str
    second: str

    def read(self, value: object, location: Location) -> Any:
        if not isinstance(value, dict):
            return read_each(value, location, self._pair)
        mapping = cast("dict[str, object]", value)
        # {from: a, to: b} is hardly meant as two pairs, of which one renames the topic "from".
        if mapping.keys() == {self.first, self.second}:
            raise location.error(f"expected a list of such pairs: - {self.first}: …")
        return tuple(
            (self._first(name, location.inner(name)), read_text(each, location.inner(name)))
            for name, each in mapping.items()
        )

    def _pair(self, value: object, location: Location) -> tuple[Text, Text]:
        record = read_fields(value, location, (self.first, self.second))
        first = self._first(record[self.first], location.inner(self.first))
        return first, read_text(record[self.second], location.inner(self.second))

    def _first(self, value: object, location: Location) -> Text:
        return read_text(value, location)

    def schema(self) -> Schema:
        return self._schema({"$ref": "#/definitions/text"})

    def _schema(self, first: Schema, **names: Schema) -> Schema:
        text = {"$ref": "#/definitions/text"}
        # The mapping that `read` refuses.
        alone = {"required": [self.first, self.second], "maxProperties": 2}
        mapping: Schema = {"type": "object", "additionalProperties": text, "not": alone, **names}
        record = record_schema({self.first: first, self.second: text})
        return {"anyOf": [mapping, {"type": "array", "items": record}]}


class Named(Pairs):
    """Pairs whose first strings are names; the last pair of a name counts."""

    def read(self, value: object, location: Location) -> Any:
        return dict(super().read(value, location))  # as in ROS 2, the last of two counts

    def _first(self, value: object, location: Location) -> Text:
        return read_name(value, location)

    def schema(self) -> Schema:
        return self._schema({"$ref": "#/definitions/name"}, propertyNames=NAMES)


def read_plain(value: object, location: Location) -> str:
    """Return a string, number or truth value as a string: a number of a YAML file as it is written there."""
    if isinstance(value, bool):
        return "true" if value else "false"  # str() would give Python's words
    if not isinstance(value, str | int | float):
        raise location.error(f"expected a string, not {_describe(value)}")
    return value.written if isinstance(value, WrittenInt | WrittenFloat) else str(value)


def read_name(value: object, location: Location) -> str:
    """Return a string without substitutions, which is needed when the file is read."""
    name = read_plain(value, location)
    # It would silently become a part of the name.
    if "$(" in name:
        raise location.error(f"expected a name without $(…), not '{escape(name)}'")
    return name


def read_text(value: object, location: Location) -> Text:
    """Return a string with its substitutions."""
    plain = read_plain(value, location)
    # Parsed when the file is read, so that a malformed `$(` is found in branches that are not taken, too.
    try:
        return template(plain)
    except LaunchError as error:
        raise location.error(str(error)) from None


def _read_flag(value: object, location: Location) -> bool | Text:
    if isinstance(value, bool | int | float) and value in {0, 1}:
        return bool(value)  # as ROS 2 reads a condition; YAML has made the numbers of it
    return read_text(value, location) if isinstance(value, str) else _read_switch(value, location)


def _read_switch(value: object, location: Location) -> bool:
    # No strings: the options of this kind are bools in Python too, and have no substitutions.
    if not isinstance(value, bool):
        raise location.error(f"expected true or false, not {_describe(value)}")
    return value


def _read_number(value: object, location: Location) -> float | Text:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, str):
        raise location.error(f"expected a number, not {_describe(value)}")
    return read_text(value, location)


def _words(text: str, location: Location) -> tuple[Text, ...]:
    try:
        return words(text)
    except LaunchError as error:
        raise location.error(str(error)) from None


def read_list(value: object, location: Location) -> list[object]:
    """Return a list."""
    if not isinstance(value, list):
        raise location.error(f"expected a list, not {_describe(value)}")
    return cast("list[object]", value)


def read_each(value: object, location: Location, read: Callable[[object, Location], T]) -> tuple[T, ...]:
    """Return the values of a list, each as `read` returns it."""
    return tuple(read(each, location.inner(at)) for at, each in enumerate(read_list(value, location)))


def read_mapping(value: object, location: Location) -> Mapping[str, object]:
    """Return a mapping."""
    if not isinstance(value, dict):
        raise location.error(f"expected a mapping, not {_describe(value)}")
    return cast("dict[str, object]", value)


def read_fields(value: object, location: Location, names: Sequence[str]) -> Mapping[str, object]:
    """Return a mapping that has exactly these keys."""
    found = read_mapping(value, location)
    for name in names:
        if name not in found:
            raise location.error(f"'{name}' is missing")
    # A misspelled key that is ignored would be a setting without effect.
    for name in found:
        if name not in names:
            raise location.inner(name).error(f"no such key{did_you_mean(name, names)}")
    return found


def record_schema(fields: Mapping[str, Schema], **optional: Schema) -> Schema:
    """Return the schema of a mapping that has exactly these keys, and perhaps optional ones."""
    return {
        "type": "object",
        "properties": {**fields, **optional},
        "required": list(fields),
        "additionalProperties": False,
    }


def _describe(value: object) -> str:
    """Return a description of a value for an error."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"the number {value}"
    if isinstance(value, str):
        return f"the string '{escape(value)}'"
    names: dict[type, str] = {type(None): "nothing", dict: "a mapping", list: "a list"}
    # TOML has dates, which are no values of launch files.
    return names.get(type(value), f"a {type(value).__name__}; put it in quotes")


TEXT: Final = SimpleKind(read_text, {"$ref": "#/definitions/text"})
"""A string with substitutions; numbers and truth values are read as strings."""
PLAIN: Final = SimpleKind(read_plain, {"$ref": "#/definitions/plain"})
"""A string in which `$(…)` has no meaning."""
PLAIN_NAME: Final = SimpleKind(read_name, {"$ref": "#/definitions/name"})
"""A string without substitutions."""
FLAG: Final = SimpleKind(_read_flag, {"anyOf": [{"type": ["boolean", "string"]}, {"enum": [0, 1]}]})
"""True or false, also as 1 or 0, or a string that contains one of these."""
SWITCH: Final = SimpleKind(_read_switch, {"type": "boolean"})
"""True or false, and nothing else."""
NUMBER: Final = SimpleKind(_read_number, {"type": ["number", "string"]})
"""A number, or a string that contains one."""
