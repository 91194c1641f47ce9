"""Writes the function that encodes the messages of a class.

As `decoder.py`, which shows the result of such a writer, the other way round: the parts of a message are
collected and joined once. Strings are parts of their own, without the NUL at their end, which the next part
begins with. A value that does not fit raises an error, which `codec.py` explains.
"""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Any, cast

from actors.interfaces.arrays import ARRAY_BY_ELEMENT, BIG_ENDIAN
from actors.interfaces.cdr import values
from actors.interfaces.cdr.layout import (
    ANYWHERE,
    LENGTH,
    NOTHING,
    PRIMITIVES,
    Item,
    array_item,
    flat_items,
    padding,
    repeatable,
)
from actors.interfaces.cdr.source import HEADER, Source
from actors.interfaces.fields import BINARY, fields_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.fields import FieldType
    from actors.interfaces.naming import MessageType

_REPRESENTATION = "256"
"""00 01: plain CDR, little-endian."""


class _Encoder(Source):
    """See the module."""

    def __init__(self) -> None:
        names: dict[str, Any] = {
            "no_bool": values.no_bool,
            "NUL": b"\0",
            "array_of": values.numbers,
            "bytes_of": values.binary,
            "bools": values.bools,
            "wide": values.write_wide,
            "texts": values.write_texts,
            "wide_texts": values.write_wide_texts,
        }
        super().__init__("<", names)
        self._run: list[tuple[Item, str]] = []
        self._is_behind_text = False
        """Whether the NUL of a string has not been written yet."""
        self._parts: list[str] = []
        self._has_out = False

    def write(self, cls: MessageType) -> Callable[[Any], bytes]:
        self.begin("def encode(m):", cls, 0)
        self._run = [(HEADER, _REPRESENTATION)]
        self._message(cls, "m")
        self._flush()
        if self._has_out:
            self._put_parts()
            self.line('return b"".join(out)')
        elif len(self._parts) == 1:
            self.line(f"return {self._parts[0]}")
        else:
            self.line(f'return b"".join(({", ".join(self._parts)}))')
        while self.pending:
            nested = self.pending.pop()
            self.begin(f"def {self.function_name(nested)}(m, out, p):", nested, None)
            self._parts, self._has_out = [], True
            self._message(nested, "m")
            self._put_parts()
            self.use_variable()
            self.line("return p")
        return cast("Callable[[Any], bytes]", self.compiled("encode"))

    def _flush(self, numbers: str = "") -> None:
        """Write the values that have been collected, and the end of a string.

        Args:
            numbers: The name of how many 8-byte numbers follow; "" if none do.
        """
        items = [item for item, _ in self._run]
        if not items:
            if self._is_behind_text:
                self._parts.append("NUL")
                self.places = frozenset((place + 1) % 8 for place in self.places)
                self.move(1)
        else:
            size: int | str
            if numbers:
                call, size = self.packing_before_numbers(items, numbers, is_behind_text=self._is_behind_text)
            else:
                call, size = self.packing("pack", items, is_behind_text=self._is_behind_text)
            part = self.variable()
            self.line(f"{part} = {call}({', '.join(value for _, value in self._run)})")
            self._parts.append(part)
            self._run = []
            self.move(size)
        self._is_behind_text = False

    def _put_parts(self) -> None:
        """Put all parts so far into `out`, as the following ones are written in a loop or by a function."""
        self._flush()
        if not self._has_out:
            self.line(f"out = [{', '.join(self._parts)}]")
        elif self._parts:
            self.line(f"out += {', '.join(self._parts)},")
        self._parts, self._has_out = [], True

    def _message(self, cls: MessageType, message: str) -> None:
        fields = fields_of(cls)
        if not fields:
            self._run.append((NOTHING, "0"))
        for field in fields:
            self._field(field.type, f"{message}.{field.name}")

    def _nested(self, cls: MessageType, message: str) -> None:
        # Another class with such fields would be written as one of this class. Which may be, decides the
        # msgpack codec.
        self.line(f"if type({message}) is not {self.constant(cls)}: raise TypeError")
        function = self.enter(cls)
        if not function:
            self._message(cls, message)
            self.leave()
            return
        self._put_parts()
        self.use_variable()
        self.line(f"p = {function}({message}, out, p)")
        self.places = ANYWHERE

    def _field(self, kind: FieldType, value: str) -> None:
        if not kind.is_array:
            if kind.message is not None:
                nested = self._assigned(value)
                self._nested(kind.message, nested)
            elif kind.base in PRIMITIVES:
                self._run.append((PRIMITIVES[kind.base], _scalar(PRIMITIVES[kind.base], value)))
            else:
                self._text(kind, value)
        elif kind.message is not None:
            self._messages(kind, kind.message, self._assigned(value))
        elif kind.base not in PRIMITIVES:
            self._texts(kind, self._assigned(value))
        else:
            self._elements(kind, self._assigned(value))

    def _assigned(self, value: str) -> str:
        name = self.variable()
        self.line(f"{name} = {value}")
        return name

    def _counted(self, kind: FieldType, value: str) -> str:
        """Write the length of a sequence, if it has any; return its name."""
        count = self._assigned(f"len({value})")
        limits = [f"{count} < {kind.low}"] if kind.low and not kind.is_fixed else []
        if kind.high is not None:
            limits.append(f"{count} {'!=' if kind.is_fixed else '>'} {kind.high}")
        if limits:
            self.line(f"if {' or '.join(limits)}: raise ValueError")
        if not kind.is_fixed:
            self._run.append((LENGTH, count))
        return count

    def _pass(self, size: str, unit: int) -> None:
        """Move behind so many bytes that are a part of their own, a multiple of a unit."""
        self.move(size)
        self.places = frozenset((place + step) % 8 for place in self.places for step in range(0, 8, unit))

    def _text(self, kind: FieldType, value: str) -> None:
        if kind.string_bound:
            self.line(f"if len({value}) > {kind.string_bound}: raise ValueError")
        if kind.base == "wstring":
            data = self._assigned(f"wide({value})")
            self._run.append((LENGTH, f"len({data}) >> 2"))
        else:
            data = self._assigned(f"{value}.encode()")
            self.line(f"if 0 in {data}: raise ValueError")
            self._run.append((LENGTH, f"len({data}) + 1"))
        self._flush()
        self._parts.append(data)
        self._pass(f"len({data})", 4 if kind.base == "wstring" else 1)
        self._is_behind_text = kind.base == "string"

    def _texts(self, kind: FieldType, value: str) -> None:
        if kind.string_bound:
            self.line(f"if max(map(len, {value}), default=0) > {kind.string_bound}: raise ValueError")
        self._counted(kind, value)
        self._flush()
        if kind.is_fixed:  # otherwise the length has been written there, which has the same alignment
            self._align(4)
        self._put_parts()
        self.line(f"p = {'wide_' if kind.base == 'wstring' else ''}texts(out, {value}, {self.where()})")
        self.at, self.places = None, ANYWHERE

    def _align(self, align: int) -> None:
        """Write padding as a part of its own."""
        if not any(padding(place, align) for place in self.places):
            return
        self.use_variable()
        pads = self.constant(tuple(bytes(padding(place, align)) for place in range(8)), ("pads", align))
        gap = self._assigned(f"{pads}[p & 7]")
        self._parts.append(gap)
        self.line(f"p += len({gap})")
        self.places = frozenset(place for place in ANYWHERE if not padding(place, align))

    def _elements(self, kind: FieldType, value: str) -> None:
        """Write a sequence of primitives."""
        if kind.base == "bool":
            self.line(f"{value} = bools({value})")
        elif kind.base in BINARY:
            self.line(f"if type({value}) is not bytes: {value} = bytes_of({value})")
        else:
            cls = self.constant(ARRAY_BY_ELEMENT[kind.base])
            # On a machine that has the other byte order, `array_of` swaps the bytes.
            test = "" if BIG_ENDIAN else f"if type({value}) is not {cls}: "
            self.line(f"{test}{value} = array_of({cls}, {value})")
        count = self._counted(kind, value)
        size = PRIMITIVES[kind.base].size
        if kind.is_fixed:
            whole = f"bytes({value})" if size == 1 else f"{value}.tobytes()"
            self._run.append((array_item(kind), whole))
            return
        self._flush(count if size == 8 else "")
        self._parts.append(value)
        self._pass(count if size == 1 else f"{size}*{count}", size)

    def _messages(self, kind: FieldType, cls: MessageType, value: str) -> None:
        count = self._counted(kind, value)
        items = None if kind.is_fixed else flat_items(cls)
        is_flat = items is not None and all(len(path) == 1 for _, path, _ in items)
        if items is not None and is_flat and repeatable([item for item, _, _ in items]):
            self.line(f"if {count} and set(map(type, {value})) != {{{self.constant(cls)}}}: raise TypeError")
            self._flush(count if items[0][0].align == 8 else "")
            self._put_parts()
            each = self.constant(_packer([item for item, _, _ in items]), ("pack", *items))
            scalars = [_scalar(item, f"m.{name}") for item, (name,), _ in items]
            self.line(f"out += [{each}({', '.join(scalars)}) for m in {value}]")
            self._pass(f"{sum(item.size for item, _, _ in items)}*{count}", items[0][0].align)
            return
        self._put_parts()
        self.use_variable()
        element = self.variable()
        self.line(f"for {element} in {value}:")
        self.indent()
        self.places = ANYWHERE
        self._nested(cls, element)
        self._put_parts()
        self.use_variable()
        self.indent(-1)
        self.places = ANYWHERE


def _scalar(item: Item, value: str) -> str:
    """Return the expression of a scalar for `struct`, which takes any object for a bool."""
    return value if item.format != "?" else f"t if type(t := {value}) is bool else no_bool()"


def _packer(items: list[Item]) -> Any:
    return Struct("<" + "".join(item.format for item in items)).pack


def encoder(cls: MessageType) -> Callable[[Any], bytes]:
    """Return a function that encodes messages of a class.

    Returns:
        The function. If a value does not fit it raises ValueError, TypeError, AttributeError, KeyError,
        OverflowError, struct.error or RecursionError.

    Raises:
        TypeError: A field has no ROS type.
    """
    return _Encoder().write(cls)
