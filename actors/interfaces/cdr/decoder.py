r"""Writes the function that decodes the messages of a class.

Values whose places are known relative to each other are read by one `struct` call; the objects are made at
the end, by one expression. The result for a class with a header and a point is

    def decode(buf):
        spare = 16777216
        h, v1, v2, v3, = C1(buf, 0)
        if h != 256: raise Unusual
        v4 = 16 + v3
        v5 = buf[16:v4 - 1].decode()
        if '\0' in v5 or buf[v4 - 1]: raise Unusual
        p = v4
        v9, v10 = C2[p & 7]
        v6, v7, v8, = v9(buf, p)
        return C5(C4(C3(v1, v2), v5), C6(v6, v7, v8))

Lengths are compared with the bytes that are left before anything is made. The memory of a sequence of
messages is charged before it is made, if elements of its type may take more than the decode budget allows for
their bytes. If that is too much, a careful decoder charges what each element really takes; it also reads what
others do not: strings that are not UTF-8, have a NUL in them or none at their end.
"""

from __future__ import annotations

from array import array
from functools import partial
from struct import Struct
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

from actors.interfaces.arrays import ARRAY_BY_ELEMENT, BIG_ENDIAN
from actors.interfaces.cdr import values
from actors.interfaces.cdr.layout import (
    ANYWHERE,
    LENGTH,
    LIST_SLOT_BYTES,
    NOTHING,
    PRIMITIVES,
    Item,
    array_item,
    element_bytes,
    excess_bytes,
    flat_items,
    held_bytes,
    is_list,
    least_bytes,
    padding,
    repeatable,
)
from actors.interfaces.cdr.source import HEADER, Source
from actors.interfaces.decode_budget import FACTOR, LIST_BYTES
from actors.interfaces.errors import MessageBudgetError
from actors.interfaces.fields import BINARY, fields_of, wires_of
from actors.interfaces.naming import MessageType

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.fields import FieldType

SPARE_BYTES: Final = 16 * 1024 * 1024
"""Memory of a message beyond `FACTOR` times its bytes. Messages in CDR have all their fields: only those with
very many small elements come near it."""

_MANY: Final = 512
"""Numbers from which on an array is made without copying its bytes twice, which takes longer for few."""


class _Decoder(Source):
    """See the module.

    Args:
        order: "<" or ">".
        is_careful: Whether it reads all strings, and charges what is there rather than the worst.
    """

    def __init__(self, order: str, *, is_careful: bool) -> None:
        names: dict[str, Any] = {
            "Short": values.TooShortError,
            "Unusual": values.UnusualError,
            "Length": values.LengthError,
            "Budget": MessageBudgetError,
            "text": values.text,
            "weight": values.text_bytes,
            "wide": values.read_wide,
            "new": cast("Any", array).__new__,
            "large": values.large_array,
            "swapped": values.swapped_array,
        }
        super().__init__(order, names)
        self._is_careful = is_careful
        self._is_swapped = (order == ">") != BIG_ENDIAN
        self._run: list[tuple[Item, str]] = []
        self._has_view = False
        self._is_checked = False
        """Whether a read at the place has just succeeded: no more bytes are needed up to there."""

    def write(self, cls: MessageType) -> Callable[[bytes], Any]:
        self.begin("def decode(buf):", cls, 0)
        self.line(f"spare = {SPARE_BYTES}")
        self._run = [(HEADER, "h")]
        made = self._message(cls)
        self._flush()
        if not self._is_checked:
            self.line(f"if {self.where()} > len(buf): raise Short")
        self.line(f"return {made}")
        if self._has_view:
            # One for all slices: each view of the bytes takes 130 bytes more than a slice of one.
            self.lines.insert(1, "    view = memoryview(buf)")
        while self.pending:
            nested = self.pending.pop()
            self.begin(f"def {self.function_name(nested)}(buf, view, p, spare):", nested, None)
            made = self._message(nested)
            self._flush()
            self.use_variable()
            self.line(f"return {made}, p, spare")
        return cast("Callable[[bytes], Any]", self.compiled("decode"))

    def _flush(self) -> None:
        """Read the values that have been collected."""
        if not self._run:
            return
        call, size = self.packing("unpack_from", [item for item, _ in self._run])
        self.line(f"{', '.join(name for _, name in self._run)}, = {call}(buf, {self.where()})")
        if self._run[0][0] is HEADER:
            self.line(f"if h != {256 if self.order == '<' else 0}: raise Unusual")
        self._run = []
        self.move(size)
        self._is_checked = True

    def _value(self, item: Item) -> str:
        name = self.variable()
        self._run.append((item, name))
        return name

    def _message(self, cls: MessageType) -> str:
        """Return the expression of a message; what it reads has been read once `_flush` is called."""
        fields, wires = fields_of(cls), wires_of(cls)
        if not fields:
            self._value(NOTHING)
        arguments = [self._field(field.type, wires[field.name], field.name) for field in fields]
        if _is_by_name(cls):
            arguments = [f"{field.name}={each}" for field, each in zip(fields, arguments, strict=True)]
        return f"{self.constant(_maker(cls), cls)}({', '.join(arguments)})"

    def _nested(self, cls: MessageType) -> str:
        function = self.enter(cls)
        if not function:
            made = self._message(cls)
            self.leave()
            return made
        self._flush()
        self.use_variable()
        made = self.variable()
        self.line(f"{made}, p, spare = {function}(buf, view, p, spare)")
        self._has_view = True
        self.places = ANYWHERE
        self._is_checked = False
        return made

    def _field(self, kind: FieldType, wire: Any, name: str) -> str:
        if not kind.is_array:
            if kind.message is not None:
                return self._nested(kind.message)
            return self._value(PRIMITIVES[kind.base]) if kind.base in PRIMITIVES else self._text(kind, name)
        if kind.message is not None:
            return self._messages(kind, kind.message, name)
        if kind.base not in PRIMITIVES:
            return self._texts(kind, name)
        return self._fixed(kind, wire) if kind.is_fixed else self._sequence(kind, wire, name)

    def _fixed(self, kind: FieldType, wire: Any) -> str:
        if kind.base not in BINARY or _plain(wire) is not memoryview:
            return self._elements(kind, wire, self._value(array_item(kind)))
        self._flush()
        start, end = self._pass(str(kind.low), 1)
        self._has_view = True
        found = self.variable()
        self.line(f"{found} = view[{start}:{end}]")
        self.line(f"p = {end}")
        return found

    def _length(self, kind: FieldType, name: str) -> str:
        """Read the length of a sequence, and check it."""
        count = self._value(LENGTH)
        self._flush()
        limits = ([f"{count} < {kind.low}"] if kind.low else []) + (
            [] if kind.high is None else [f"{count} > {kind.high}"]
        )
        if limits:
            text = f"{name}: Expected {kind}, got %d elements"
            self.line(f"if {' or '.join(limits)}: raise Length({text!r} % {count})")
        return count

    def _require(self, size: str) -> None:
        self.line(f"if {size} > len(buf) - {self.where()}: raise Short")

    def _charge_elements(self, cls: MessageType, count: str) -> None:
        """Charge elements before they are made."""
        excess = LIST_SLOT_BYTES + excess_bytes(cls, is_exact=self._is_careful)
        if excess > 0 or self._is_careful:
            self.line(f"spare -= {excess}*{count}")
            self.line("if spare < 0: raise Budget")

    def _charge(self, memory: str, size: str) -> None:
        """Charge what a string or sequence takes, for its bytes."""
        if self._is_careful:
            self.line(f"spare += {FACTOR}*({size} + {LENGTH.size}) - ({memory})")

    def _pass(self, size: str, unit: int) -> tuple[str, str]:
        """Move behind so many bytes, a multiple of a unit; return the expressions of their limits."""
        start, end = self.where(), self.variable()
        self.line(f"{end} = {start} + {size}")
        self.at = None
        self.places = frozenset((place + step) % 8 for place in self.places for step in range(0, 8, unit))
        self._is_checked = False
        return start, end

    def _text(self, kind: FieldType, name: str) -> str:
        size = self._value(LENGTH)
        self._flush()
        is_wide = kind.base == "wstring"
        start, end = self._pass(f"{size}*4" if is_wide else size, 4 if is_wide else 1)
        found = self.variable()
        if is_wide:
            self.line(f"{found} = wide(buf[{start}:{end}], {self.order!r})")
        elif self._is_careful:
            self.line(f"{found} = text(buf[{start}:{end}])")
        else:
            self.line(f"{found} = buf[{start}:{end} - 1].decode()")
            self.line(rf"if '\0' in {found} or buf[{end} - 1]: raise Unusual")
        self.line(f"p = {end}")
        self._charge(
            f"weight({found})", f"{end} - {start}" if start != "p" else f"4*{size}" if is_wide else size
        )
        if kind.string_bound:
            text = f"{name}: Expected {kind}, got %d characters"
            self.line(f"if len({found}) > {kind.string_bound}: raise Length({text!r} % len({found}))")
        return found

    def _texts(self, kind: FieldType, name: str) -> str:
        if kind.is_fixed:
            self._flush()
            count = str(kind.low)
        else:
            count = self._length(kind, name)
        is_wide = kind.base == "wstring"
        read = self.constant(
            values.text_reader(self.order, is_careful=self._is_careful, is_wide=is_wide), ("texts", is_wide)
        )
        self.use_variable()
        found, start = self.variable(), self.variable()
        self.line(f"{start} = p")
        self.line(f"{found}, p = {read}(buf, p, {count})")
        self.places, self._is_checked = ANYWHERE, False
        self._charge(f"{LIST_BYTES} + {LIST_SLOT_BYTES}*{count} + sum(map(weight, {found}))", f"p - {start}")
        if kind.string_bound:
            text = f"{name}: Expected {kind}, got a longer string"
            self.line(f"if max(map(len, {found}), default=0) > {kind.string_bound}: raise Length({text!r})")
        return found

    def _sequence(self, kind: FieldType, wire: Any, name: str) -> str:
        count = self._length(kind, name)
        item = PRIMITIVES[kind.base]
        if any(padding(place, item.align) for place in self.places):  # of 8 bytes: the length has 4
            self.use_variable()
            self.line(f"if {count}: p += 4 - p & 7")
            self.places |= {place + padding(place, item.align) & 7 for place in self.places}
        size = count if item.size == 1 else f"{item.size}*{count}"
        memory = element_bytes(kind, wire)
        if memory > FACTOR * item.size:
            self._require(size)
            self.line(f"spare -= {memory - FACTOR * item.size}*{count}")
            self.line("if spare < 0: raise Budget")
            memory = FACTOR * item.size
        self._charge(f"{held_bytes(kind, wire)} + {memory}*{count}", size)
        start, end = self._pass(size, item.size)
        found = self.variable()
        content = f"buf[{start}:{end}]"
        if kind.base in BINARY and _plain(wire) is memoryview:
            made, self._has_view = f"view[{start}:{end}]", True
        elif kind.base in ARRAY_BY_ELEMENT and not self._is_swapped and not is_list(wire):
            large = f"large({self.constant(ARRAY_BY_ELEMENT[kind.base])}, buf, {start}, {end})"
            made = f"{large} if {count} > {_MANY} else {self._elements(kind, wire, content)}"
        else:
            made = self._elements(kind, wire, content)
        self.line(f"{found} = {made}")
        self.line(f"p = {end}")
        return found

    def _elements(self, kind: FieldType, wire: Any, data: str) -> str:
        """Return the expression of a sequence of primitives, from bytes."""
        if kind.base == "bool":
            return f"list(map(bool, {data}))"
        if kind.base in BINARY:
            plain = _plain(wire)
            return data if plain is bytes else f"{plain.__name__}({data})"
        cls = ARRAY_BY_ELEMENT[kind.base]
        name = self.constant(cls)
        made = f"swapped({name}, {data})" if self._is_swapped else f"new({name}, {cls.format!r}, {data})"
        return f"{made}.tolist()" if is_list(wire) else made

    def _messages(self, kind: FieldType, cls: MessageType, name: str) -> str:
        if kind.is_fixed:
            self._flush()
            count = str(kind.low)
        else:
            count = self._length(kind, name)
            items = flat_items(cls)
            if items is not None and repeatable([item for item, _, _ in items]):
                return self._flat_messages(cls, [item for item, _, _ in items], count)
        self.use_variable()
        self._require(f"{least_bytes(cls)}*{count}")
        self._charge(str(LIST_BYTES), "0")
        if not self._is_careful:
            self._charge_elements(cls, count)
        found, add = self.variable(), self.variable()
        self.line(f"{found} = []")
        self.line(f"{add} = {found}.append")
        self.line(f"for _ in range({count}):")
        self.indent()
        self.places = ANYWHERE
        if self._is_careful:
            self._charge_elements(cls, "1")
        made = self._nested(cls)
        self._flush()
        self.line(f"{add}({made})")
        self.use_variable()
        self.indent(-1)
        self.places = ANYWHERE
        self._is_checked = False
        return found

    def _flat_messages(self, cls: MessageType, items: list[Item], count: str) -> str:
        """Read messages that follow each other in one format."""
        if any(padding(place, items[0].align) for place in self.places):
            self.use_variable()
            self.line(f"if {count}: p += 4 - p & 7")
        size = sum(item.size for item in items)
        self._require(f"{size}*{count}")
        self._charge(str(LIST_BYTES), "0")
        self._charge_elements(cls, count)
        self.places |= {place for place in ANYWHERE if not padding(place, items[0].align)}
        start, end = self._pass(f"{size}*{count}", items[0].align)
        whole, self._run = self._run, []
        made = self._message(cls)
        names = "".join(f"{name}, " for _, name in self._run)
        self._run = whole
        each = self.constant(_iterator(self.order, items), ("iterate", *items))
        found = self.variable()
        self.line(f"{found} = [{made} for {names}in {each}(buf[{start}:{end}])]")
        self.line(f"p = {end}")
        return found


def _iterator(order: str, items: list[Item]) -> Any:
    return Struct(order + "".join(item.format for item in items)).iter_unpack


def _plain(wire: Any) -> Any:
    """Return the class of a field of bytes."""
    return getattr(wire, "__origin__", wire)


def _is_by_name(cls: MessageType) -> bool:
    """Return whether a class takes its fields by name only."""
    parameters: dict[str, Any] = cast("Any", cls).__signature__.parameters
    return any(each.kind is each.KEYWORD_ONLY for each in parameters.values())


def _maker(cls: MessageType) -> Any:
    """Return what makes a message of a class, without anything that a program has put in front of it."""
    if type(cls) is MessageType and "__call__" not in vars(MessageType):
        return cls
    return partial(msgspec.StructMeta.__call__, cls)


def decoder(cls: MessageType, order: str, *, is_careful: bool) -> Callable[[bytes], Any]:
    """Return a function that decodes messages of a class.

    Args:
        cls: The class.
        order: "<" for little-endian messages, ">" for others.
        is_careful: Whether it reads all strings, and charges what is there rather than the worst. If not, the
            function is faster, and raises UnusualError or UnicodeDecodeError for unusual strings.

    Returns:
        The function. It raises UnusualError for another representation, MessageBudgetError, and ValueError,
        struct.error, IndexError, OverflowError or RecursionError for a message that is too short or wrong.

    Raises:
        TypeError: A field has no ROS type.
    """
    return _Decoder(order, is_careful=is_careful).write(cls)
