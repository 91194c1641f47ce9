"""What the writers of encoders and decoders share: lines of Python, constants, the place in the message."""

from __future__ import annotations

import keyword
from functools import cache
from struct import Struct
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.cdr.layout import ANYWHERE, Item, packed
from actors.interfaces.fields import fields_of, nested_classes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.interfaces.naming import MessageType

MAX_INLINED: Final = 400
"""Fields of nested messages whose code is part of one function; the code of others is in functions of their
own, so that the code of a type is no longer than its definition."""
MAX_DEPTH: Final = 12
"""The same for levels of nesting: Python allows 20 loops in each other."""

HEADER: Final = Item("H2x", 4, 1)


@cache
def _struct(text: str) -> Struct:
    return Struct(text)


class Source:
    """Functions in Python that are being written, and where in a message the one in work is.

    Args:
        order: "<" or ">".
        names: What the functions may use.

    Attributes:
        lines: The lines of all functions.
        at: The place, if it is the same in all messages; None if it is in the variable `p`.
        places: The places where it can be, modulo 8.
        pending: Classes that need functions of their own.
    """

    def __init__(self, order: str, names: dict[str, Any]) -> None:
        self.order = order
        self.names = names
        self.lines: list[str] = []
        self.at: int | None = None
        self.places = ANYWHERE
        self.pending: list[MessageType] = []
        self._moves: list[str] = []
        self._depth = 0
        self._count = 0
        self._inlined = 0
        self._open: list[MessageType] = []
        self._constants: dict[Any, str] = {}
        self._functions: dict[MessageType, str] = {}

    def line(self, text: str) -> None:
        """Add a line."""
        self.lines.append("    " * self._depth + text)

    def indent(self, levels: int = 1) -> None:
        """Begin a block, or end one with -1."""
        self._depth += levels

    def begin(self, head: str, cls: MessageType, place: int | None) -> None:
        """Begin the function of a class with its first line and the place there; None if that is in `p`."""
        self._depth = 0
        self.line(head)
        self._depth = 1
        self._inlined = 0
        self._open = [cls]
        self._moves = []
        self.at = place
        self.places = ANYWHERE if place is None else frozenset({place & 7})

    def variable(self) -> str:
        """Return a new name."""
        self._count += 1
        return f"v{self._count}"

    def constant(self, value: Any, key: Any = None) -> str:
        """Return the name of a value that the functions use; it has one name for each `key`."""
        key = value if key is None else key
        if key not in self._constants:
            self._constants[key] = f"C{len(self._constants)}"
            self.names[self._constants[key]] = value
        return self._constants[key]

    def enter(self, cls: MessageType) -> str:
        """Begin the code of a nested message; return the name of a function if it has one of its own."""
        is_long = self._inlined + len(fields_of(cls)) > MAX_INLINED
        if is_long or len(self._open) >= MAX_DEPTH or cls in self._open:
            if cls not in self._functions:
                self._functions[cls] = f"f{len(self._functions)}"
                self.pending.append(cls)
            return self._functions[cls]
        self._inlined += len(fields_of(cls))
        self._open.append(cls)
        return ""

    def leave(self) -> None:
        """End the code of a nested message."""
        self._open.pop()

    def function_name(self, cls: MessageType) -> str:
        """Return the name of the function of a class in `pending`."""
        return self._functions[cls]

    def where(self) -> str:
        """Return the expression of the place."""
        self._settle()
        return "p" if self.at is None else str(self.at)

    def use_variable(self) -> None:
        """Have the place in `p` from here on."""
        self._settle()
        if self.at is not None:
            self.line(f"p = {self.at}")
            self.at = None

    def move(self, size: int | str) -> None:
        """Move the place by the size of values that were read or written."""
        if isinstance(size, int) and self.at is not None and not self._moves:
            self.at += size
        elif size:
            self._moves.append(str(size))

    def _settle(self) -> None:
        """Write the moves since the last time: most places are never asked for."""
        if self._moves:
            self.line(f"p {'+=' if self.at is None else f'= {self.at} +'} {' + '.join(self._moves)}")
            self.at, self._moves = None, []

    def packing(
        self, method: str, items: Sequence[Item], *, is_behind_text: bool = False
    ) -> tuple[str, int | str]:
        """Return the names of what reads or writes values at this place, and of their size.

        Args:
            method: A method of `struct.Struct`.
            items: The values.
            is_behind_text: As for `packed`.
        """
        found = {
            place: packed(self.order, place, items, is_behind_text=is_behind_text) for place in self.places
        }
        self.places = frozenset((place + size) % 8 for place, (_, size) in found.items())
        if len(set(found.values())) == 1:
            text, size = next(iter(found.values()))
            return self.constant(getattr(_struct(text), method), (method, text)), size
        self.use_variable()
        call, length = self.variable(), self.variable()
        self.line(f"{call}, {length} = {self._table(method, found)}[p & 7]")
        return call, length

    def packing_before_numbers(
        self, items: Sequence[Item], count: str, *, is_behind_text: bool
    ) -> tuple[str, str]:
        """Return the same for values before an array of 8-byte numbers, which is aligned if it has any."""
        tables: list[str] = []
        ends: set[int] = set()
        for align in (1, 8):
            found = {
                place: packed(self.order, place, items, is_behind_text=is_behind_text, last_align=align)
                for place in self.places
            }
            ends |= {(place + size) % 8 for place, (_, size) in found.items()}
            tables.append(self._table("pack", found))
        self.use_variable()
        self.places = frozenset(ends)
        call, length = self.variable(), self.variable()
        self.line(f"{call}, {length} = ({tables[1]} if {count} else {tables[0]})[p & 7]")
        return call, length

    def _table(self, method: str, found: dict[int, tuple[str, int]]) -> str:
        rows = [found.get(place) for place in range(8)]
        made = tuple(row and (getattr(_struct(row[0]), method), row[1]) for row in rows)
        return self.constant(made, (method, tuple(rows)))

    def compiled(self, name: str) -> Any:
        """Return the function of this name."""
        code = compile("\n".join(self.lines) + "\n", "<cdr>", "exec", dont_inherit=True)
        # Of what a definition says, only the names of fields are in it, which `check_names` has seen.
        exec(code, self.names)  # noqa: S102
        return self.names[name]


def check_names(cls: MessageType) -> None:
    """Raise TypeError if a field's name is a keyword: the names become part of a program.

    All names are identifiers, as msgspec makes `__slots__` of them.
    """
    for each in nested_classes(cls):
        for field in fields_of(each):
            if keyword.iskeyword(field.name):
                raise TypeError(
                    f"Field '{field.name}' of message class {each.__qualname__} is a Python keyword"
                )
