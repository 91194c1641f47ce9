"""Errors in launch documents, and places in them."""

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
        spot: Its place.
        line: Its line, from 1; None: not known.
    """

    def __init__(self, text: str, spot: Spot, line: int | None = None) -> None:
        super().__init__(text)
        self.text = text
        self.spot = spot
        self.line = line


@dataclass(frozen=True)
class Spot:
    """A place in a document.

    Attributes:
        steps: The keys, and the numbers in lists, that lead to it.
        describe: Returns the place with its file and line; None: these are not known.
    """

    steps: tuple[str | int, ...] = ()
    describe: Callable[[Spot], str] | None = field(default=None, compare=False, repr=False)

    def inner(self, step: str | int) -> Spot:
        """Return the place of a value in it, by key or number."""
        return Spot((*self.steps, step), self.describe)

    def place(self) -> str:
        """Return the place with its file and line, as far as these are known."""
        return str(self) if self.describe is None else self.describe(self)

    def error(self, text: str) -> DocumentError:
        """Return an error at this place, to be raised."""
        return DocumentError(text, self)

    def __str__(self) -> str:
        """Return the place in the notation "launch[3].node.parameters"."""
        steps = (f"[{step}]" if isinstance(step, int) else f".{escape(step)}" for step in self.steps)
        return "".join(steps).removeprefix(".")
