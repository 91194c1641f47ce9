"""Check the signature of a callback when it is registered, and name and await callbacks."""

from __future__ import annotations

import asyncio
import inspect
from contextvars import ContextVar
from types import CoroutineType
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine


ENDS_PROGRAM: Final = (KeyboardInterrupt, SystemExit)
"""Exceptions of a callback that end the program. All others are errors of the callback."""

exit_ends_node: Final[ContextVar[bool]] = ContextVar("callboard_exit_ends_node", default=False)
"""Whether nodes started in this context are programs among others in this process.

If so, SystemExit in a callback ends its node and is raised by whatever runs the node, not by the loop.
"""


def positional_limits(callback: Callable[..., Any]) -> tuple[int, float]:
    """Return the least and the greatest number of positional arguments a callable takes."""
    least, most = 0, 0.0
    for parameter in inspect.signature(callback).parameters.values():
        if parameter.kind is parameter.VAR_POSITIONAL:
            most = float("inf")
        elif parameter.kind in {parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD}:
            most += 1
            least += parameter.default is parameter.empty
    return least, most


def takes(callback: Callable[..., Any], choices: tuple[int, ...], what: str) -> int:
    """Return the greatest of `choices` that the callback can be called with.

    Raises:
        RuntimeError: None of them fits (the exception type is rclpy's).
    """
    least, most = positional_limits(callback)
    # Optional parameters need no argument: `def f(msg, seen=[])` gets one.
    fitting = [number for number in choices if least <= number <= most]
    if not fitting:
        numbers = f"{' or '.join(map(str, choices))} argument{'s' * (choices != (1,))}"
        raise RuntimeError(f"A {what} callback takes {numbers}; {name_of(callback)} does not")
    wanted = [number for number in fitting if number == least]
    return wanted[0] if wanted else max(fitting)


def as_coroutine(result: object) -> Coroutine[Any, Any, Any] | None:
    """Return the result of a callback as a coroutine to run; None if it is not awaitable."""
    # The type is compared first because asyncio.iscoroutine takes longer, and this is the hot path.
    if type(result) is CoroutineType or asyncio.iscoroutine(result):
        return result  # pyright: ignore[reportUnknownVariableType]
    if inspect.isawaitable(result):
        return _await(result)
    return None


async def _await(awaitable: Awaitable[Any]) -> Any:
    return await awaitable


def name_of(callback: Callable[..., Any]) -> str:
    """Return the callback's name for logs and errors."""
    return getattr(callback, "__qualname__", None) or repr(callback)
