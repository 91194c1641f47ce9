"""Programs: what `actors.run` and a supervisor can run, and how each kind of it is run."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from typing import Any, Protocol, TypeAlias, cast, runtime_checkable


@runtime_checkable
class Runnable(Protocol):
    """What runs by itself, once: a node or a supervisor."""

    async def run(self) -> None:
        """Run to the end."""
        ...


Factory: TypeAlias = Callable[[], Runnable] | Callable[[], Coroutine[Any, Any, Any]]
"""What can be run again and again: a class or function that returns a node or a supervisor, or a coroutine
function."""

Program: TypeAlias = Runnable | Factory


async def run_program(program: Program) -> Any:
    """Run a program to its end.

    Returns:
        What a coroutine function returned, else None.

    Raises:
        TypeError: It gave neither a node, nor a supervisor, nor a coroutine.
    """
    made: object = program if is_instance(program) else cast("Factory", program)()
    if isinstance(made, Runnable):
        return await made.run()
    if inspect.isawaitable(made):
        return await made
    raise TypeError(f"{program!r} returned {made!r}; wanted are nodes or coroutine functions, or supervisors")


def is_instance(program: object) -> bool:
    """Tell whether this is a node or a supervisor that has been made already."""
    return isinstance(program, Runnable) and not isinstance(program, type)
