"""Messages from and to plain values: dicts, YAML, CSV; for the command line and for human-readable output.

The `message_to_` functions take a message, or the dict that `codec.decode_untyped` returns for an unknown
type; then sequences are described by their received types.
"""

from __future__ import annotations

import copy
import math
import re
from collections import OrderedDict
from datetime import datetime
from functools import cache
from itertools import islice
from secrets import token_hex
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

import msgspec

from actors.interfaces.arrays import NumericArray
from actors.interfaces.codec import codec_for
from actors.interfaces.decode_budget import require_possible
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.fields import BINARY, IDL_NAMES, fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.message import Message, type_name
from actors.interfaces.yaml_reader import PlainText
from actors.interfaces.yaml_scalars import rcl_scalar, yaml_scalar

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.interfaces.fields import FieldType

_MAX_WIDTH: Final = 2**31 - 1
_MAX_DEPTH: Final = 64
"""Limit of the nesting of a printed message; real types have about ten levels."""
_LONG: Final = 64
"""Numbers in a list from which on it is written without PyYAML."""
_NUMBERS: Final = frozenset({bool, int, float})
_FLAT: Final[tuple[type[Any], ...]] = (bytes, bytearray, memoryview, NumericArray)
"""Sequences of numbers only."""
T = TypeVar("T", bound=Message)


def set_message_fields(message: Message, values: Mapping[str, Any]) -> None:
    """Set fields of a message; after an error none is set.

    Args:
        message: The message; fields that are not in `values` keep their values.
        values: Field name to value: a dict for a nested message, a list of dicts for a sequence of messages.
            A `PlainText` is what its text means for the field's type.

    Raises:
        AttributeError: A key is not a field.
        TypeError: `values`, or the value of a nested message, is not a dict.
        ValueError: A value does not fit its field.
    """
    filled = _filled(type(message), message, values, type_name(type(message)))
    # Encoded for its checks only. The message is changed after them, so that an error leaves it as it was.
    codec_for(type(message)).encode(filled)
    for name in message.__struct_fields__:
        setattr(message, name, getattr(filled, name))


def message_from_fields(msg_type: type[T], values: Mapping[str, Any]) -> T:
    """Return a new message.

    Args:
        msg_type: Its class.
        values: As for `set_message_fields`.

    Raises:
        AttributeError: A key is not a field.
        TypeError: `values`, or the value of a nested message, is not a dict.
        ValueError: A value does not fit its field, or a field without default is missing.
        MessageBudgetError: A new message of this class takes more than `MAX_NEW_BYTES`.
    """
    require_possible(msg_type)
    filled = cast("T", _filled(msg_type, None, values, type_name(msg_type)))
    codec_for(msg_type).encode(filled)
    return filled


def _filled(cls: type[Message], current: Message | None, values: Any, path: str) -> Message:
    """Return a copy of `current`, or a new message, with `values` in place."""
    if not isinstance(values, dict):
        raise TypeError(f"{path}: Expected a dict of field values, got {_kind(values)}")
    types = {field.name: field.type for field in fields_of(cls)}
    converted: dict[str, Any] = {}
    for name, value in cast("Any", values).items():
        if name not in types:
            raise AttributeError(f"{path} has no field '{name}'; it has {', '.join(types) or 'no fields'}")
        converted[name] = _converted(types[name], value, getattr(current, name, None), f"{path}.{name}")
    if current is None:
        try:
            return cls(**converted)
        except TypeError as error:
            raise ValueError(f"{path}: {error}") from None
    # Shallow: fields that are not given keep their values, which are not changed.
    filled = copy.copy(current)
    for name, value in converted.items():
        setattr(filled, name, value)
    return filled


def _converted(field_type: FieldType, value: Any, current: Any, path: str) -> Any:
    if field_type.message is not None:
        nested = cast("type[Message]", field_type.message)
        if not field_type.is_array:
            return value if isinstance(value, nested) else _filled(nested, current, value, path)
        if not isinstance(value, list | tuple):
            raise ValueError(f"{path}: Expected a list, got {_kind(value)}")
        return [
            item if isinstance(item, nested) else _filled(nested, None, item, f"{path}[{index}]")
            for index, item in enumerate(cast("list[Any]", value))
        ]
    if not field_type.is_array:
        return _scalar(field_type, value, path)
    if isinstance(value, str) or not hasattr(value, "__iter__"):
        raise ValueError(f"{path}: Expected a list, got {_kind(value)}")
    # The codec converts these faster, and without a number in Python for each element.
    if isinstance(value, bytes | bytearray | memoryview | NumericArray) or hasattr(value, "dtype"):
        return cast("Any", value)
    converted = [_scalar(field_type, item, f"{path}[{index}]") for index, item in enumerate(value)]
    if field_type.base in BINARY:
        return b"".join(item if isinstance(item, bytes) else bytes([item]) for item in converted)
    return converted


def _scalar(field_type: FieldType, value: Any, path: str) -> Any:
    """Convert a command line's value: `data: 5` is text for a string field, and 1 is true for a bool."""
    base = field_type.base
    if isinstance(value, PlainText):
        value = _resolved(value, base)
    if base in {"string", "wstring"} and isinstance(value, bool | int | float):
        return str(value)
    if base == "bool" and isinstance(value, int) and value in {0, 1}:
        return bool(value)
    if base in {"float32", "float64"} and isinstance(value, str | int) and not isinstance(value, bool):
        try:
            return float(value)
        except ValueError:
            raise ValueError(f"{path}: Expected a number, got {value!r}") from None
    if base in INTEGER_RANGE and isinstance(value, float) and value.is_integer():
        value = int(value)
    if base == "byte" or (base in BINARY and field_type.is_array):
        return _byte(value, path, character=not field_type.is_array)
    return value


def _byte(value: Any, path: str, *, character: bool) -> bytes:
    if isinstance(value, bytes) and len(value) == 1:
        return value
    if character and isinstance(value, str) and len(value) == 1:  # as it is printed
        value = ord(value)
    if not isinstance(value, int) or not 0 <= value <= 255:
        raise ValueError(f"{path}: Expected an integer from 0 to 255, got {value!r}")
    return bytes([value])


def _resolved(text: str, base: str) -> object:
    """Return what an unquoted text is for a field of a type."""
    text = str(text)
    if base in {"string", "wstring"}:
        return text
    value = yaml_scalar(text)
    if not isinstance(value, str) or base == "byte":
        return value
    # What is a string for PyYAML may be a bool or a number for rcl: `y`, `08`, `nan`.
    found = rcl_scalar(text)
    return found if isinstance(found, bool) == (base == "bool") else value


def _kind(value: object) -> str:
    return "str" if isinstance(value, str) else type(value).__name__


class _Renderer:
    """Converts values to plain ones; shortens or omits what the options say."""

    def __init__(self, truncate_length: int | None, *, no_arr: bool, no_str: bool) -> None:
        self._limit = truncate_length
        self._no_arr = no_arr
        self._no_str = no_str
        self._depth = 0

    def message(self, message: Message) -> OrderedDict[str, Any]:
        fields = fields_of(type(message))
        return OrderedDict((f.name, self.value(getattr(message, f.name), f.type)) for f in fields)

    def mapping(self, values: Mapping[str, Any]) -> OrderedDict[str, Any]:
        return OrderedDict((str(name), self.value(value, None)) for name, value in values.items())

    def value(self, value: Any, field_type: FieldType | None) -> Any:
        # A message of unknown type is whatever its sender has encoded.
        if self._depth > _MAX_DEPTH:
            raise InvalidMessageError(f"Not a message: it is nested more than {_MAX_DEPTH} levels deep")
        self._depth += 1
        try:
            return self._plain(value, field_type)
        finally:
            self._depth -= 1

    def _plain(self, value: Any, field_type: FieldType | None) -> Any:
        plain: Any = value
        if isinstance(value, Message):
            plain = self.message(value)
        elif isinstance(value, dict):
            plain = self.mapping(cast("dict[str, Any]", value))
        elif isinstance(value, str):
            plain = self._text(value)
        elif isinstance(value, msgspec.msgpack.Ext):
            plain = f"<extension {value.code}, length: {len(bytes(value.data))}>"
        elif isinstance(value, datetime):
            plain = value.isoformat()
        elif hasattr(value, "dtype"):
            plain = self._plain(value.tolist(), field_type)
        elif field_type is not None and field_type.base == "byte" and not field_type.is_array:
            plain = self._text(value.decode("latin-1"))
        elif hasattr(value, "__len__"):
            plain = self._sequence(value, field_type)
        return plain

    def _text(self, value: str) -> str:
        if self._no_str:
            return f"<string length: <{len(value)}>>"
        return value if self._limit is None or len(value) <= self._limit else value[: self._limit] + "..."

    def _sequence(self, value: Any, field_type: FieldType | None) -> Any:
        if self._no_arr:
            return _described(value, field_type)
        kept = islice(value, self._limit)
        # Sequences of numbers need no look at each element.
        numbers = isinstance(value, _FLAT)
        items = list(kept) if numbers else [self.value(item, None) for item in kept]
        return items if len(items) == len(value) else [*items, "..."]


def _described(value: Any, field_type: FieldType | None) -> str:
    if field_type is not None:
        base = field_type.base
    elif isinstance(value, NumericArray):
        base = value.element
    else:
        base = "uint8" if isinstance(value, bytes | bytearray | memoryview) else "unknown"
    name = IDL_NAMES.get(base, base)
    if field_type is not None and field_type.is_fixed:
        return f"<array type: {name}[{field_type.high}]>"
    return f"<sequence type: {name}, length: {len(cast('Any', value))}>"


def message_to_ordereddict(
    message: Message | Mapping[str, Any],
    *,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
) -> OrderedDict[str, Any]:
    """Return a message as nested dicts, lists, numbers and strings.

    Args:
        message: A message, or the dict of a message of unknown type.
        truncate_length: Longer strings and sequences are cut to this many items and `...`; None: never.
        no_arr: Describe sequences (`<sequence type: double, length: 3>`) rather than list them.
        no_str: Describe strings (`<string length: <15>>`) rather than show them.

    Raises:
        InvalidMessageError: A message of unknown type is nested too deeply.
    """
    renderer = _Renderer(truncate_length, no_arr=no_arr, no_str=no_str)
    return renderer.message(message) if isinstance(message, Message) else renderer.mapping(message)


def message_to_yaml(
    message: Message | Mapping[str, Any],
    *,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
    flow_style: bool = False,
) -> str:
    """Return a message as YAML, ending with a newline; the arguments are `message_to_ordereddict`'s.

    Args:
        message: A message, or the dict of a message of unknown type.
        truncate_length: See `message_to_ordereddict`.
        no_arr: See `message_to_ordereddict`.
        no_str: See `message_to_ordereddict`.
        flow_style: One line in braces rather than one line per field.
    """
    import yaml  # noqa: PLC0415 - slow to import, and only output to read needs it

    plain = message_to_ordereddict(message, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str)
    numbers: list[list[float]] = []
    # Random, so that no text of a message can be taken for a mark.
    mark = f"numbers_{token_hex(8)}_"
    text: str = yaml.dump(
        _dict(plain, mark, numbers),
        Dumper=_dumper_type(),
        allow_unicode=True,
        default_flow_style=flow_style,
        sort_keys=False,
        width=_MAX_WIDTH,
    )
    return _with_numbers(text, mark, numbers, flow_style=flow_style) if numbers else text


class _QuotedKey(str):
    """A key that YAML would write in several lines, or with control characters."""

    __slots__ = ()


@cache
def _dumper_type() -> Any:
    """Return PyYAML's safe dumper, which writes a `_QuotedKey` in quotes and in one line."""
    import yaml  # noqa: PLC0415 - see above

    base: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    dumper_type: Any = type("Dumper", (base,), {})
    dumper_type.add_representer(_QuotedKey, _represent_key)
    return dumper_type


def _represent_key(dumper: Any, key: Any) -> Any:
    return dumper.represent_scalar("tag:yaml.org,2002:str", str(key), style='"')


def _dict(value: Any, mark: str, numbers: list[list[float]]) -> Any:
    """Convert ordered dicts to dicts, for YAML's safe dumper; move long lists into `numbers`."""
    if isinstance(value, dict):
        fields = cast("dict[str, Any]", value).items()
        return {
            name if name.isprintable() else _QuotedKey(name): _dict(item, mark, numbers)
            for name, item in fields
        }
    if not isinstance(value, list):
        return value
    items: list[Any] = cast("Any", value)
    # Types are compared exactly: a subclass may print in its own way.
    if len(items) >= _LONG and _NUMBERS.issuperset(map(type, items)):
        numbers.append(items)
        return [f"{mark}{len(numbers) - 1}"]
    return [_dict(item, mark, numbers) for item in items]


def _with_numbers(text: str, mark: str, numbers: list[list[float]], *, flow_style: bool) -> str:
    """Replace marks by their lists of numbers: PyYAML takes seconds for an image."""

    def listed(match: re.Match[str]) -> str:
        texts = map(_number, numbers[int(match["index"])])
        if flow_style:
            return match["before"] + ", ".join(texts)
        return match["before"] + f"\n{' ' * (len(match['before']) - 2)}- ".join(texts)

    before = "" if flow_style else "^[ :-]*- "
    return re.sub(f"(?P<before>{before}){mark}(?P<index>[0-9]+)", listed, text, flags=re.MULTILINE)


def _number(value: float) -> str:
    """Return a number as PyYAML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if not math.isfinite(value):
        return ".nan" if value != value else ".inf" if value > 0 else "-.inf"  # noqa: PLR0124 - that is NaN
    # YAML reads `1e10` as a string, and `1.0e10` as a number.
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e", 1)


def message_to_csv(
    message: Message | Mapping[str, Any],
    *,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
) -> str:
    """Return a message's values in order, separated by commas; see `message_to_ordereddict`."""
    flat: list[str] = []

    def walk(value: Any) -> None:
        if isinstance(value, dict):
            value = list(cast("dict[str, Any]", value).values())
        if not isinstance(value, list):
            flat.append(str(value))
        elif _NUMBERS.issuperset(map(type, cast("Any", value))):
            flat.extend(map(str, cast("Any", value)))
        else:
            for item in cast("Any", value):
                walk(item)

    walk(message_to_ordereddict(message, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str))
    return ",".join(flat)
