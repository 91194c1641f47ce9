"""Iterations over what arrives: messages, feedback, changes of the graph."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from typing import Self

T = TypeVar("T")


class Iteration(ABC, Generic[T]):
    """An asynchronous iterator that survives a cancelled step. One task at a time may use it.

    A step that is cancelled, as by `asyncio.wait_for(anext(iteration), 0.1)`, loses no item: the next step
    returns what has arrived meanwhile. An asynchronous generator would end with its first cancelled step.

    Attributes:
        closed: Whether `aclose` has been called.
    """

    def __init__(self) -> None:
        self.closed = False

    def __aiter__(self) -> Self:
        return self

    @abstractmethod
    async def __anext__(self) -> T:
        """Return the next item, or raise StopAsyncIteration at the end."""

    async def aclose(self) -> None:
        """End the iteration, as `contextlib.aclosing` does. A waiting step ends as well."""
        self.closed = True
        self._wake()

    @abstractmethod
    def _wake(self) -> None:
        """Wake a waiting step, which then checks `closed`."""
