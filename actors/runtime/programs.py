"""Programs that `actors.run` and a supervisor can run, and how to run each kind."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from typing import Any, Protocol, TypeAlias, cast, runtime_checkable


@runtime_checkable
class Runnable(Protocol):
    """An object that runs once: a node or a supervisor."""

    async def run(self) -> None:
        """Run to the end."""
        ...


Factory: TypeAlias = Callable[[], Runnable] | Callable[[], Coroutine[Any, Any, Any]]
"""A class or function that returns a new node or supervisor, or a coroutine function; it can run
repeatedly."""

Program: TypeAlias = Runnable | Factory


async def run_program(program: Program) -> Any:
    """Run a program to its end.

    Returns:
        The result of a coroutine function, else None.

    Raises:
        TypeError: It can be neither run nor called, or returned neither a node, nor a supervisor, nor a
            coroutine.
    """
    require_program(program)
    # A factory is called here, in the running loop and after the command line is parsed: a node takes its
    # arguments from the context in which it is made.
    made: object = program if is_instance(program) else cast("Factory", program)()
    if isinstance(made, Runnable):
        return await made.run()
    if inspect.isawaitable(made):
        return await made
    raise TypeError(
        f"{program!r} returned {made!r}: expected a node, a supervisor or, as from `async def`, a coroutine"
    )


def require_program(program: object) -> None:
    """Raise TypeError if a program can be neither run nor called."""
    if inspect.iscoroutine(program):
        program.close()  # otherwise Python warns that it was never awaited, which hides the mistake
        name = program.__name__
        raise TypeError(f"Expected a function, not a coroutine: pass {name} without calling it, not {name}()")
    if not (is_instance(program) or callable(program)):
        raise TypeError(f"Expected nodes, supervisors, or functions that return one, not {program!r}")


def is_instance(program: object) -> bool:
    """Return whether a program is a node or a supervisor, not a factory of them."""
    # The class itself has a `run`, too, so that the protocol's check is true of it.
    return isinstance(program, Runnable) and not isinstance(program, type)
