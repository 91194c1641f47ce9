"""Coroutines that raise a clear error if a caller forgets `await` and uses them as results, as with rclpy."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar, cast

if TYPE_CHECKING:
    from collections.abc import Generator

T_co = TypeVar("T_co", covariant=True)
CoroutineFunction = TypeVar("CoroutineFunction", bound=Callable[..., Coroutine[Any, Any, Any]])


class MustAwait(Coroutine[Any, Any, T_co]):
    """A coroutine without a truth value, that can neither be iterated over nor compared with values.

    So `while not client.wait_for_service(1.0)` raises a TypeError that asks for `await`, whereas a plain
    coroutine would be true. `create_task`, `gather` and `wait_for` accept it like any coroutine.

    Args:
        coroutine: The coroutine to wrap.
    """

    def __init__(self, coroutine: Coroutine[Any, Any, T_co]) -> None:
        self._coroutine = coroutine
        # asyncio and debuggers show these names for the tasks that run a coroutine.
        self.__name__ = getattr(coroutine, "__name__", "coroutine")
        self.__qualname__ = getattr(coroutine, "__qualname__", self.__name__)

    def __await__(self) -> Generator[Any, Any, T_co]:
        return self._coroutine.__await__()

    def send(self, value: Any) -> Any:
        """Implement Coroutine."""
        return self._coroutine.send(value)

    def throw(self, *exception: Any) -> Any:
        """Implement Coroutine."""
        return self._coroutine.throw(*exception)

    def close(self) -> None:
        """Implement Coroutine."""
        self._coroutine.close()

    def _refuse(self, *_: object) -> NoReturn:
        raise TypeError(f"{self.__qualname__}() is a coroutine: write `await` before it to get its result")

    __bool__ = __iter__ = __len__ = __contains__ = _refuse

    def __eq__(self, other: object) -> bool:
        # Between coroutines identity is what sets, dicts and `gather` (which removes duplicates) need.
        # Compared with anything else, a result was meant.
        return self is other if isinstance(other, Coroutine) else self._refuse()

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        return f"<awaitable {self._coroutine!r}>"


def must_await(function: CoroutineFunction) -> CoroutineFunction:
    """Make a coroutine function return `MustAwait`. Its type stays the same for type checkers.

    From Python 3.12 on `inspect.iscoroutinefunction` is true for it. On 3.11 it is not: there only
    `asyncio.iscoroutinefunction`, now deprecated, takes a mark, which is private.
    """

    @wraps(function)
    def call(*args: Any, **options: Any) -> MustAwait[Any]:
        return MustAwait(function(*args, **options))

    if sys.version_info >= (3, 12):
        inspect.markcoroutinefunction(call)
    return cast("CoroutineFunction", call)
