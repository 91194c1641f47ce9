"""What can be wrong with a launch document, and where in it that is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from proto.errors import escape

if TYPE_CHECKING:
    from collections.abc import Callable


class DocumentError(ValueError):
    """A document does not say what can be launched; the reader makes a `LaunchFileError` of it.

    Attributes:
        text: What is wrong.
        spot: Where.
        line: The line, from 1, where it is known.
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
        describe: Says it with its file and line; None: nobody knows these.
    """

    steps: tuple[str | int, ...] = ()
    describe: Callable[[Spot], str] | None = field(default=None, compare=False, repr=False)

    def inner(self, step: str | int) -> Spot:
        """Return the place of a value in it, by key or number."""
        return Spot((*self.steps, step), self.describe)

    def place(self) -> str:
        """Return it as people find it: with its file and line, as far as these are known."""
        return str(self) if self.describe is None else self.describe(self)

    def error(self, text: str) -> DocumentError:
        """Return an error to raise: something is wrong there."""
        return DocumentError(text, self)

    def __str__(self) -> str:
        """Return it as people write it, such as "launch[3].node.parameters"."""
        steps = (f"[{step}]" if isinstance(step, int) else f".{escape(step)}" for step in self.steps)
        return "".join(steps).removeprefix(".")
