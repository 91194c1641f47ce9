"""What a callback may look like, found out once when it is given."""

from __future__ import annotations

import asyncio
import inspect
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine


ENDS_PROGRAM: Final = (KeyboardInterrupt, SystemExit)
"""What a callback may raise to end the program. Everything else is an error of the callback's."""

exit_ends_node: Final[ContextVar[bool]] = ContextVar("callboard_exit_ends_node", default=False)
"""Whether a node that is started here is one program among others in this process: SystemExit in a callback
ends the node then, and is raised to whoever runs it, instead of going through the loop."""


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
        RuntimeError: None of them fits (rclpy's type for it); says what does.
    """
    least, most = positional_limits(callback)
    # Optional parameters are the callback's own business: `def f(msg, seen=[])` wants one argument.
    fitting = [number for number in choices if least <= number <= most]
    if not fitting:
        numbers = " or ".join(map(str, choices))
        raise RuntimeError(f"A {what} callback takes {numbers} arguments; {name_of(callback)} does not")
    wanted = [number for number in fitting if number == least]
    return wanted[0] if wanted else max(fitting)


def as_coroutine(result: object) -> Coroutine[Any, Any, Any] | None:
    """Return what a callback returned as a coroutine to run; None if it is nothing to await."""
    if asyncio.iscoroutine(result):
        return result
    if inspect.isawaitable(result):
        return _await(result)
    return None


async def _await(awaitable: Awaitable[Any]) -> Any:
    return await awaitable


def name_of(callback: Callable[..., Any]) -> str:
    """Return a name for messages."""
    return getattr(callback, "__qualname__", None) or repr(callback)
