"""Errors in launch documents, and locations in them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable


class DocumentError(ValueError):
    """An error in a launch document; the reader turns it into a `LaunchFileError`.

    Attributes:
        text: The error.
        location: Its location.
        line: Its line, from 1; None: not known.
    """

    def __init__(self, text: str, location: Location, line: int | None = None) -> None:
        super().__init__(text)
        self.text = text
        self.location = location
        self.line = line


@dataclass(frozen=True)
class Location:
    """A location in a document.

    Attributes:
        path: The keys, and the indexes in lists, that lead to it.
        formatter: Returns the location with its file and line; None: these are not known.
    """

    path: tuple[str | int, ...] = ()
    # Finding a line parses the file again, so this happens only for errors.
    formatter: Callable[[Location], str] | None = field(default=None, compare=False, repr=False)

    def inner(self, key: str | int) -> Location:
        """Return the location of a value in it, by key or index."""
        return Location((*self.path, key), self.formatter)

    def describe(self) -> str:
        """Return the location with its file and line, as far as these are known."""
        return str(self) if self.formatter is None else self.formatter(self)

    def error(self, text: str) -> DocumentError:
        """Return an error at this location, to be raised."""
        return DocumentError(text, self)

    def __str__(self) -> str:
        """Return the location in the notation "launch[3].node.parameters"."""
        keys = (f"[{key}]" if isinstance(key, int) else f".{escape(key)}" for key in self.path)
        return "".join(keys).removeprefix(".")
